// Measures closest hits per second of Embree's rtcIntersect1 on one thread, for the triangles and rays that the example
// `traversal` writes. The figures are in docs/notebook/peers.md.
//
//     cargo run --release --example traversal -- SCENE medium FOLDER
//     apt-get install libembree-dev
//     c++ -O3 -march=native tests/reference/embree.cc -lembree3 -o FOLDER/embree
//     FOLDER/embree FOLDER [rounds]
//
// Each figure is the median over the rounds of rays per processor time of the thread. Made for Trisect.
#include <embree3/rtcore.h>
#include <time.h>

#include <algorithm>
#include <cfloat>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

static std::vector<float> read(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  std::vector<float> numbers(file ? size_t(file.tellg()) / sizeof(float) : 0);
  file.seekg(0);
  file.read(reinterpret_cast<char*>(numbers.data()), numbers.size() * sizeof(float));
  if (!file || numbers.empty()) {
    std::fprintf(stderr, "%s cannot be read\n", path.c_str());
    std::exit(1);
  }
  return numbers;
}

static double seconds() {
  timespec time;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return time.tv_sec + time.tv_nsec * 1e-9;
}

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: embree FOLDER [ROUNDS]\n");
    return 2;
  }
  const std::string folder = std::string(argv[1]) + "/";
  const int rounds = argc > 2 ? std::max(1, std::atoi(argv[2])) : 5;
  const std::vector<float> vertices = read(folder + "triangles");
  const size_t triangles = vertices.size() / 9;

  const auto start = std::chrono::steady_clock::now();
  RTCDevice device = rtcNewDevice(nullptr);
  RTCScene scene = rtcNewScene(device);
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* to = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, triangles * 3);
  std::memcpy(to, vertices.data(), triangles * 36);
  auto* index = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangles));
  for (size_t i = 0; i < 3 * triangles; ++i) index[i] = unsigned(i);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
  const std::chrono::duration<double> built = std::chrono::steady_clock::now() - start;
  std::printf("Embree " RTC_VERSION_STRING ": %zu triangles; built in %.2f s\n", triangles, built.count());

  for (const char* name : {"primary", "diffuse", "shuffled"}) {
    const std::vector<float> rays = read(folder + name);
    const size_t count = rays.size() / 6;
    std::vector<double> times;
    size_t hits = 0;
    double sum = 0;
    for (int round = 0; round < rounds; ++round) {
      hits = 0;
      sum = 0;
      const double begin = seconds();
      for (size_t i = 0; i < count; ++i) {
        const float* from = &rays[6 * i];
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        RTCRayHit ray;
        ray.ray.org_x = from[0], ray.ray.org_y = from[1], ray.ray.org_z = from[2];
        ray.ray.dir_x = from[3], ray.ray.dir_y = from[4], ray.ray.dir_z = from[5];
        ray.ray.tnear = 0, ray.ray.tfar = FLT_MAX, ray.ray.time = 0;
        ray.ray.mask = ~0u, ray.ray.flags = 0;
        ray.hit.geomID = ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(scene, &context, &ray);
        if (ray.hit.geomID != RTC_INVALID_GEOMETRY_ID) ++hits, sum += ray.ray.tfar;
      }
      times.push_back(seconds() - begin);
    }
    std::sort(times.begin(), times.end());
    std::printf("%-20s %8.2f Mrays/s   %zu hits, mean distance %.6f\n", name, count / times[rounds / 2] * 1e-6, hits,
                sum / hits);
  }
  rtcReleaseScene(scene);
  rtcReleaseDevice(device);
}
