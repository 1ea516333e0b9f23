// Stands in for Open Image Denoise in tests: checks how it is called, and returns half of the
// radiance. The variable FAKE_OIDN makes one step fail, states version 1, asks for the image's
// mean in each pixel ("mean"), refuses images above 200,000 pixels ("small"), or does so and takes
// 4 microseconds for a pixel ("slow"). With OLD it has the functions of version 1 instead.

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#if defined(_WIN32)
#define EXPORT extern "C" __declspec(dllexport)
#else
#define EXPORT extern "C" __attribute__((visibility("default")))
#endif

#ifdef OLD
EXPORT int oidnGetDevice1i(void*, const char*) { return 1; }
EXPORT void* oidnNewDevice(int) { return nullptr; }
#else

struct Image {
    std::vector<float>* buffer = nullptr;
    size_t width = 0, height = 0;
};
struct Filter {
    Image color, albedo, normal, output;
    bool hdr = false, clean = false, committed = false;
    int quality = 0;
};

static std::string error;
static bool committed = false;
static int features = 0, objects = 0;

static bool is(const char* step) {
    const char* value = std::getenv("FAKE_OIDN");
    return value && std::strcmp(value, step) == 0;
}
static void fail(const char* message) {
    if (error.empty()) error = message;
}

EXPORT void* oidnNewDevice(int type) {
    if (type != 0 || is("no device")) { fail("no device, says the fake"); return nullptr; }
    objects++;
    return &committed;
}
EXPORT void oidnReleaseDevice(void*) { if (--objects != 0) std::abort(); }
EXPORT void oidnCommitDevice(void*) { committed = true; if (is("device")) fail("no device, says the fake"); }
EXPORT void oidnSetDeviceInt(void*, const char* name, int value) {
    if (std::strcmp(name, "numThreads") != 0 || value < 1) fail("not a number of threads");
}
EXPORT int oidnGetDeviceInt(void*, const char* name) {
    if (std::strcmp(name, "versionMajor") == 0) return is("version 1") ? 1 : 2;
    if (std::strcmp(name, "versionMinor") == 0) return 3;
    if (std::strcmp(name, "type") == 0) return 1;
    return 0;
}
EXPORT int oidnGetDeviceError(void*, const char** message) {
    static std::string last;
    last = error;
    error.clear();
    *message = last.c_str();
    return last.empty() ? 0 : 1;
}
EXPORT void* oidnNewBuffer(void*, size_t bytes) {
    if (!committed) fail("the device is not committed");
    if (is("memory")) { fail("out of memory, says the fake"); return nullptr; }
    objects++;
    return new std::vector<float>(bytes / sizeof(float));
}
EXPORT void oidnReleaseBuffer(void* buffer) { objects--; delete static_cast<std::vector<float>*>(buffer); }
EXPORT void oidnWriteBuffer(void* buffer, size_t offset, size_t bytes, const void* from) {
    auto& to = *static_cast<std::vector<float>*>(buffer);
    if (offset + bytes > to.size() * sizeof(float)) { fail("beyond the buffer"); return; }
    std::memcpy(reinterpret_cast<char*>(to.data()) + offset, from, bytes);
}
EXPORT void oidnReadBuffer(void* buffer, size_t offset, size_t bytes, void* to) {
    auto& from = *static_cast<std::vector<float>*>(buffer);
    if (offset + bytes > from.size() * sizeof(float)) { fail("beyond the buffer"); return; }
    std::memcpy(to, reinterpret_cast<char*>(from.data()) + offset, bytes);
}
EXPORT void* oidnNewFilter(void*, const char* type) {
    if (std::strcmp(type, "RT") != 0) { fail("unknown filter"); return nullptr; }
    objects++;
    return new Filter;
}
EXPORT void oidnReleaseFilter(void* filter) { objects--; delete static_cast<Filter*>(filter); }
EXPORT void oidnSetFilterImage(void* of, const char* name, void* buffer, int format, size_t width, size_t height,
                               size_t offset, size_t pixel, size_t row) {
    auto& filter = *static_cast<Filter*>(of);
    if (format != 3 || offset != 0 || pixel != 12 || row != 12 * width) fail("unexpected layout");
    Image image{static_cast<std::vector<float>*>(buffer), width, height};
    if (image.buffer->size() != 3 * width * height) fail("a buffer of another size");
    if (std::strcmp(name, "color") == 0) filter.color = image;
    else if (std::strcmp(name, "albedo") == 0) filter.albedo = image;
    else if (std::strcmp(name, "normal") == 0) filter.normal = image;
    else if (std::strcmp(name, "output") == 0) filter.output = image;
    else fail("unknown image");
}
EXPORT void oidnSetFilterInt(void* of, const char* name, int value) {
    if (std::strcmp(name, "quality") != 0) fail("unknown number");
    static_cast<Filter*>(of)->quality = value;
}
EXPORT void oidnSetFilterBool(void* of, const char* name, bool value) {
    auto& filter = *static_cast<Filter*>(of);
    if (std::strcmp(name, "hdr") == 0) filter.hdr = value;
    else if (std::strcmp(name, "cleanAux") == 0) filter.clean = value;
    else fail("unknown switch");
}
EXPORT void oidnCommitFilter(void* of) {
    static_cast<Filter*>(of)->committed = true;
    if (is("commit")) fail("no weights, says the fake");
}
static void check(const Image& image, float least, float most) {
    if (!image.buffer) return;
    for (float value : *image.buffer)
        if (!(value >= least && value <= most)) fail("a value out of range");
}
EXPORT void oidnExecuteFilter(void* of) {
    auto& filter = *static_cast<Filter*>(of);
    if (!filter.committed || !filter.output.buffer) fail("an incomplete filter");
    if (is("execute")) fail("a lost device, says the fake");
    check(filter.color, -1e30f, 1e30f);
    check(filter.albedo, 0, 1);
    check(filter.normal, -1, 1);
    if (!filter.color.buffer) {
        if (filter.hdr || filter.clean || filter.quality != 4) fail("a feature with settings of the radiance");
        features++;
        return;
    }
    if (!filter.albedo.buffer || !filter.normal.buffer || !filter.hdr || !filter.clean || features % 2 != 0 ||
        features == 0)
        fail("no features without noise");
    const size_t size = filter.color.buffer->size();
    if (is("slow")) std::this_thread::sleep_for(std::chrono::microseconds(4 * size / 3));
    if ((is("slow") || is("small")) && size / 3 > 200000) fail("a large image, says the fake");
    double sums[3] = {0, 0, 0};
    for (size_t i = 0; i < size; i++) sums[i % 3] += (*filter.color.buffer)[i];
    for (size_t i = 0; i < size; i++)
        (*filter.output.buffer)[i] = is("mean") ? float(3 * sums[i % 3] / size) : 0.5f * (*filter.color.buffer)[i];
}
#endif
