// An independent program for the final scene of "Ray Tracing in One Weekend", version 4: the book's algorithm in
// double precision, written for this project as a reference; it shares no code with Trisect.
// It differs from the book's text in three points: metal adds fuzz times a point that is uniform in the unit ball, as
// the note in rtiow_final.json says; a BVH finds the same hits faster; the random numbers are xoshiro256++ for each row.
// usage: ref SPP SEED PREFIX [threads=1] [--brute] [--fault NAME] [--json PATH] [--size W H]
//        ref --verify
// Writes PREFIX_mean.f64, PREFIX_varmean.f64 (row-major, top row first, RGB), PREFIX_meta.json
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

struct V { double x = 0, y = 0, z = 0; };
static inline V operator+(V a, V b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline V operator-(V a, V b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline V operator-(V a) { return {-a.x, -a.y, -a.z}; }
static inline V operator*(double s, V a) { return {s * a.x, s * a.y, s * a.z}; }
static inline V operator*(V a, V b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
static inline V operator/(V a, double s) { return {a.x / s, a.y / s, a.z / s}; }
static inline double dot(V a, V b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline V cross(V a, V b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
static inline V unit(V a) { return a / std::sqrt(dot(a, a)); }
static inline V reflect(V v, V n) { return v - 2 * dot(v, n) * n; }
static inline V refract(V uv, V n, double eta) {
  double c = std::fmin(dot(-uv, n), 1.0);
  V perp = eta * (uv + c * n);
  V par = -std::sqrt(std::fabs(1.0 - dot(perp, perp))) * n;
  return perp + par;
}

static inline uint64_t splitmix(uint64_t& s) {
  uint64_t z = (s += 0x9e3779b97f4a7c15ull);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}
struct Rng {  // xoshiro256++
  uint64_t s[4];
  Rng(uint64_t seed, uint64_t row) {
    uint64_t a = seed; uint64_t k = splitmix(a);
    uint64_t b = row ^ 0xd1b54a32d192ed03ull; k ^= splitmix(b) * 0x2545f4914f6cdd1dull;
    for (auto& w : s) w = splitmix(k);
  }
  static uint64_t rotl(uint64_t x, int k) { return (x << k) | (x >> (64 - k)); }
  uint64_t next() {
    uint64_t r = rotl(s[0] + s[3], 23) + s[0], t = s[1] << 17;
    s[2] ^= s[0]; s[3] ^= s[1]; s[1] ^= s[2]; s[0] ^= s[3]; s[2] ^= t; s[3] = rotl(s[3], 45);
    return r;
  }
  double u() { return (next() >> 11) * 0x1p-53; }              // [0,1)
  double u(double a, double b) { return a + (b - a) * u(); }
};
static V in_ball(Rng& g) { for (;;) { V p{g.u(-1, 1), g.u(-1, 1), g.u(-1, 1)}; if (dot(p, p) < 1) return p; } }
static V unit_vec(Rng& g) { for (;;) { V p{g.u(-1, 1), g.u(-1, 1), g.u(-1, 1)}; double l = dot(p, p); if (1e-160 < l && l <= 1) return p / std::sqrt(l); } }

enum Mat { DIFFUSE, METAL, DIEL };
struct Sphere { V c; double r; Mat m; V alb; double fuzz, ior; };
struct Scene {
  std::vector<Sphere> s;
  V from, at, vup; double vfov, defocus, focus, tmin; int w, h, depth; V bot, top;
};

// ---- minimal JSON ----
struct J { enum T { NUL, NUM, STR, ARR, OBJ } t = NUL; double n = 0; std::string s; std::vector<J> a; std::vector<std::pair<std::string, J>> o;
  const J& operator[](const char* k) const { for (auto& p : o) if (p.first == k) return p.second; fprintf(stderr, "missing key %s\n", k); exit(2); }
  V v() const { if (t != ARR || a.size() != 3) { fprintf(stderr, "not a vec3\n"); exit(2); } return {a[0].num(), a[1].num(), a[2].num()}; }
  double num() const { if (t != NUM) { fprintf(stderr, "not a number\n"); exit(2); } return n; } };
struct JP { const char* p;
  void ws() { while (*p == ' ' || *p == '\n' || *p == '\t' || *p == '\r') ++p; }
  void need(char c) { ws(); if (*p != c) { fprintf(stderr, "json: expected %c got %.20s\n", c, p); exit(2); } ++p; }
  std::string str() { need('"'); std::string r; while (*p && *p != '"') { if (*p == '\\') ++p; r += *p++; } need('"'); return r; }
  J val() { ws(); J j;
    if (*p == '{') { j.t = J::OBJ; ++p; ws(); if (*p == '}') { ++p; return j; } for (;;) { ws(); auto k = str(); need(':'); j.o.push_back({k, val()}); ws(); if (*p == ',') { ++p; continue; } need('}'); return j; } }
    if (*p == '[') { j.t = J::ARR; ++p; ws(); if (*p == ']') { ++p; return j; } for (;;) { j.a.push_back(val()); ws(); if (*p == ',') { ++p; continue; } need(']'); return j; } }
    if (*p == '"') { j.t = J::STR; j.s = str(); return j; }
    char* e; j.n = strtod(p, &e); if (e == p) { fprintf(stderr, "json: bad value %.20s\n", p); exit(2); } p = e; j.t = J::NUM; return j; } };

static Scene load(const std::string& path) {
  std::ifstream f(path); if (!f) { fprintf(stderr, "cannot open %s\n", path.c_str()); exit(2); }
  std::stringstream ss; ss << f.rdbuf(); std::string txt = ss.str(); JP jp{txt.c_str()}; J j = jp.val();
  Scene sc; auto& c = j["camera"];
  sc.from = c["lookfrom"].v(); sc.at = c["lookat"].v(); sc.vup = c["vup"].v(); sc.vfov = c["vfov_deg"].num();
  sc.defocus = c["defocus_angle_deg"].num(); sc.focus = c["focus_dist"].num(); sc.w = (int)c["image_width"].num();
  sc.h = (int)c["image_height"].num(); sc.depth = (int)c["max_depth"].num(); sc.tmin = c["t_min"].num();
  sc.bot = j["sky"]["bottom"].v(); sc.top = j["sky"]["top"].v();
  for (auto& q : j["spheres"].a) { Sphere s; s.c = q["center"].v(); s.r = q["radius"].num(); s.alb = q["albedo"].v(); s.fuzz = q["fuzz"].num(); s.ior = q["ior"].num();
    auto& m = q["material"].s; if (m == "diffuse") s.m = DIFFUSE; else if (m == "metal") s.m = METAL; else if (m == "dielectric") s.m = DIEL; else { fprintf(stderr, "material %s\n", m.c_str()); exit(2); }
    sc.s.push_back(s); }
  return sc;
}

// ---- geometry ----
static inline bool hit_sphere(const Sphere& s, V o, V d, double tmin, double tmax, double& t) {
  V oc = s.c - o; double a = dot(d, d), h = dot(d, oc), c = dot(oc, oc) - s.r * s.r;
  double disc = h * h - a * c; if (disc < 0) return false;
  double q = std::sqrt(disc), root = (h - q) / a;
  if (root <= tmin || tmax <= root) { root = (h + q) / a; if (root <= tmin || tmax <= root) return false; }
  t = root; return true;
}
struct Node { double lo[3], hi[3]; int left, right, first, count; };
struct Bvh {
  const std::vector<Sphere>* sp; std::vector<Node> n; std::vector<int> idx, big;
  void build(const std::vector<Sphere>& s) { sp = &s; for (int i = 0; i < (int)s.size(); ++i) (s[i].r > 100 ? big : idx).push_back(i); if (!idx.empty()) rec(0, (int)idx.size()); }
  void box(int b, int e, double* lo, double* hi) const {
    for (int k = 0; k < 3; ++k) { lo[k] = 1e300; hi[k] = -1e300; }
    for (int i = b; i < e; ++i) { auto& s = (*sp)[idx[i]]; double c[3] = {s.c.x, s.c.y, s.c.z}; for (int k = 0; k < 3; ++k) { lo[k] = std::min(lo[k], c[k] - s.r - 1e-6); hi[k] = std::max(hi[k], c[k] + s.r + 1e-6); } } }
  static double area(const double* lo, const double* hi) { double x = hi[0] - lo[0], y = hi[1] - lo[1], z = hi[2] - lo[2]; return x * y + y * z + z * x; }
  int rec(int b, int e) {
    int me = (int)n.size(); n.push_back({}); Node nd{}; box(b, e, nd.lo, nd.hi); nd.first = b; nd.count = e - b; nd.left = nd.right = -1;
    if (e - b > 2) {  // full-sweep SAH
      double best = 1e300; int ba = 0, bs = b + 1;
      for (int ax = 0; ax < 3; ++ax) { srt(b, e, ax); for (int m = b + 1; m < e; ++m) { double l[3], h[3], l2[3], h2[3]; box(b, m, l, h); box(m, e, l2, h2); double c = area(l, h) * (m - b) + area(l2, h2) * (e - m); if (c < best) { best = c; ba = ax; bs = m; } } }
      srt(b, e, ba); nd.count = 0; n[me] = nd; int L = rec(b, bs), R = rec(bs, e); nd.left = L; nd.right = R; }
    n[me] = nd; return me; }
  void srt(int b, int e, int ax) { std::sort(idx.begin() + b, idx.begin() + e, [&](int p, int q) { V a = (*sp)[p].c, c = (*sp)[q].c; double u = ax == 0 ? a.x : ax == 1 ? a.y : a.z, v = ax == 0 ? c.x : ax == 1 ? c.y : c.z; return u != v ? u < v : p < q; }); }
  // Entry distance of the box, or +inf if missed. NaN (0*inf) is dropped: comparisons with NaN are false, so the bound stays.
  static double slab(const Node& k, const double* o, const double* inv, double tmax) {
    double t0 = 0, t1 = tmax;
    for (int i = 0; i < 3; ++i) { double a = (k.lo[i] - o[i]) * inv[i], b = (k.hi[i] - o[i]) * inv[i]; if (inv[i] < 0) std::swap(a, b); if (a > t0) t0 = a; if (b < t1) t1 = b; }
    return t0 <= t1 * (1 + 1e-12) ? t0 : std::numeric_limits<double>::infinity(); }
  int hit(V o, V d, double tmin, double& tbest) const {
    int id = -1; double t; tbest = std::numeric_limits<double>::infinity();
    for (int i : big) if (hit_sphere((*sp)[i], o, d, tmin, tbest, t)) { tbest = t; id = i; }
    if (n.empty()) return id;
    double oo[3] = {o.x, o.y, o.z}, inv[3] = {1 / d.x, 1 / d.y, 1 / d.z}; const double INF = std::numeric_limits<double>::infinity();
    struct E { int i; double t; } st[128]; int top = 0; double tr = slab(n[0], oo, inv, tbest); if (tr < INF) st[top++] = {0, tr};
    while (top) { E e = st[--top]; if (e.t > tbest) continue; const Node& k = n[e.i];
      if (k.left < 0) { for (int j = k.first; j < k.first + k.count; ++j) if (hit_sphere((*sp)[idx[j]], o, d, tmin, tbest, t)) { tbest = t; id = idx[j]; } continue; }
      double tl = slab(n[k.left], oo, inv, tbest), t2 = slab(n[k.right], oo, inv, tbest);
      E a{k.left, tl}, b{k.right, t2}; if (a.t < b.t) std::swap(a, b); if (a.t < INF) st[top++] = a; if (b.t < INF) st[top++] = b; }
    return id; }
  int brute(V o, V d, double tmin, double& tbest) const {
    int id = -1; double t; tbest = std::numeric_limits<double>::infinity();
    for (int i = 0; i < (int)sp->size(); ++i) if (hit_sphere((*sp)[i], o, d, tmin, tbest, t)) { tbest = t; id = i; }
    return id; }
};

static bool g_brute = false; static std::string g_fault;
static bool f_sphere_fuzz, f_no_coslobe, f_schlick_t;

static V ray_color(const Scene& sc, const Bvh& bv, V o, V d, int depth, Rng& g) {
  V thr{1, 1, 1};
  for (; depth > 0; --depth) {
    double t; int id = g_brute ? bv.brute(o, d, sc.tmin, t) : bv.hit(o, d, sc.tmin, t);
    if (id < 0) { double a = 0.5 * (unit(d).y + 1.0); return thr * ((1.0 - a) * sc.bot + a * sc.top); }
    const Sphere& s = sc.s[id];
    V p = o + t * d, n = (p - s.c) / s.r; bool front = dot(d, n) < 0; if (!front) n = -n;
    V nd;
    if (s.m == DIFFUSE) {
      V r = unit_vec(g);
      if (f_no_coslobe) { nd = dot(r, n) > 0 ? r : -r; }
      else { nd = n + r; if (std::fabs(nd.x) < 1e-8 && std::fabs(nd.y) < 1e-8 && std::fabs(nd.z) < 1e-8) nd = n; }
      thr = thr * s.alb;
    } else if (s.m == METAL) {
      nd = unit(reflect(d, n)) + s.fuzz * (f_sphere_fuzz ? unit_vec(g) : in_ball(g));
      if (!(dot(nd, n) > 0)) return {};
      thr = thr * s.alb;
    } else {
      double ri = front ? 1.0 / s.ior : s.ior; V ud = unit(d);
      double c = std::fmin(dot(-ud, n), 1.0), sn = std::sqrt(1.0 - c * c);
      bool tir = ri * sn > 1.0; double cs = c;
      if (f_schlick_t && !front && !tir) cs = std::sqrt(std::max(0.0, 1 - ri * ri * sn * sn));
      double r0 = (1 - ri) / (1 + ri); r0 *= r0; double R = r0 + (1 - r0) * std::pow(1 - cs, 5);
      if (tir || R > g.u()) nd = reflect(ud, n); else nd = refract(ud, n, ri);
    }
    o = p; d = nd;
  }
  return {};
}

struct Camera { V center, p00, du, dv, ddu, ddv; double defocus;
  Camera(const Scene& s, int W, int H) {
    const double PI = 3.1415926535897932385; center = s.from; defocus = s.defocus;
    double h = std::tan(s.vfov * PI / 180 / 2), vh = 2 * h * s.focus, vw = vh * (double(W) / H);
    V w = unit(s.from - s.at), u = unit(cross(s.vup, w)), v = cross(w, u);
    V vu = vw * u, vv = vh * -v; du = vu / W; dv = vv / H;
    V ul = center - s.focus * w - vu / 2 - vv / 2; p00 = ul + 0.5 * (du + dv);
    double dr = s.focus * std::tan(s.defocus / 2 * PI / 180); ddu = dr * u; ddv = dr * v; }
  void ray(int i, int j, Rng& g, V& o, V& d) const {
    double ox = g.u() - 0.5, oy = g.u() - 0.5; V ps = p00 + (i + ox) * du + (j + oy) * dv;
    o = center;
    if (defocus > 0) { double x, y; do { x = g.u(-1, 1); y = g.u(-1, 1); } while (!(x * x + y * y < 1)); o = center + x * ddu + y * ddv; }
    d = ps - o; } };

static int verify(const Scene& sc, const Bvh& bv) {
  Rng g(987654321, 0); Camera cam(sc, sc.w, sc.h); long N = 400000, bad = 0, hits = 0;
  for (long k = 0; k < N; ++k) { V o, d; double t1, t2; int kind = k % 4;
    if (kind == 0) { cam.ray(int(g.u() * sc.w), int(g.u() * sc.h), g, o, d); }
    else { const Sphere& s = sc.s[size_t(g.u() * sc.s.size())]; V r = unit_vec(g); o = s.r > 100 ? V{g.u(-14, 14), 0, g.u(-14, 14)} : s.c + s.r * r;
      d = kind == 1 ? unit_vec(g) : kind == 2 ? in_ball(g) : unit_vec(g);
      if (kind == 3) { int z = int(g.u() * 7); if (z & 1) d.x = (z & 4) ? 0.0 : -0.0; if (z & 2) d.y = 0; if ((z & 3) == 0) d.z = 1e-30; if (dot(d, d) == 0) d = {0, 1, 0}; } }
    int a = bv.hit(o, d, sc.tmin, t1), b = bv.brute(o, d, sc.tmin, t2); hits += b >= 0;
    if (t1 != t2 || a != b) { if (t1 != t2 || (a < 0) != (b < 0)) ++bad; } }
  printf("verify: %ld rays, %ld hit, %ld mismatches\n", N, hits, bad); return bad != 0; }

int main(int c, char** v) {
  std::string json = "scenes/source/rtiow_final.json"; std::vector<std::string> pos; bool ver = false; int W = 0, H = 0;
  for (int i = 1; i < c; ++i) { std::string a = v[i];
    if (a == "--brute") g_brute = true; else if (a == "--fault") g_fault = v[++i]; else if (a == "--json") json = v[++i];
    else if (a == "--verify") ver = true; else if (a == "--size") { W = atoi(v[++i]); H = atoi(v[++i]); } else pos.push_back(a); }
  Scene sc = load(json); if (!W) { W = sc.w; H = sc.h; }
  if (g_fault == "albedo") for (auto& s : sc.s) { if (s.m == DIFFUSE) s.alb = 1.01 * s.alb; }
  else if (g_fault == "fuzzsphere") f_sphere_fuzz = true; else if (g_fault == "coslobe") f_no_coslobe = true; else if (g_fault == "schlick_t") f_schlick_t = true;
  else if (g_fault == "ior") { for (auto& s : sc.s) if (s.m == DIEL) s.ior = 1.45; } else if (g_fault == "nodefocus") sc.defocus = 0; else if (g_fault == "depth5") sc.depth = 5;
  else if (!g_fault.empty()) { fprintf(stderr, "unknown fault\n"); return 2; }
  Bvh bv; bv.build(sc.s);
  if (ver) return verify(sc, bv);
  if (pos.size() < 3) { fprintf(stderr, "usage: ref SPP SEED PREFIX [threads]\n"); return 2; }
  long spp = atol(pos[0].c_str()); uint64_t seed = strtoull(pos[1].c_str(), 0, 10); std::string pre = pos[2]; int nt = pos.size() > 3 ? atoi(pos[3].c_str()) : 1;
  if (spp < 2) { fprintf(stderr, "spp >= 2\n"); return 2; }
  Camera cam(sc, W, H); std::vector<double> mean(size_t(W) * H * 3), vm(mean.size()); std::atomic<int> row{0}; auto t0 = std::chrono::steady_clock::now();
  auto work = [&] { for (int j; (j = row++) < H;) { Rng g(seed, j);
    for (int i = 0; i < W; ++i) { double m[3] = {0, 0, 0}, q[3] = {0, 0, 0};
      for (long k = 1; k <= spp; ++k) { V o, d; cam.ray(i, j, g, o, d); V L = ray_color(sc, bv, o, d, sc.depth, g); double x[3] = {L.x, L.y, L.z};
        for (int e = 0; e < 3; ++e) { double dl = x[e] - m[e]; m[e] += dl / k; q[e] += dl * (x[e] - m[e]); } }
      for (int e = 0; e < 3; ++e) { size_t z = (size_t(j) * W + i) * 3 + e; mean[z] = m[e]; vm[z] = q[e] / (spp - 1) / spp; } } } };
  std::vector<std::thread> th; for (int i = 1; i < nt; ++i) th.emplace_back(work); work(); for (auto& t : th) t.join();
  double sec = std::chrono::duration<double>(std::chrono::steady_clock::now() - t0).count();
  auto wr = [&](std::string f, std::vector<double>& a) { FILE* o = fopen(f.c_str(), "wb"); if (!o || fwrite(a.data(), 8, a.size(), o) != a.size() || fclose(o)) { perror(f.c_str()); exit(1); } };
  wr(pre + "_mean.f64", mean); wr(pre + "_varmean.f64", vm);
  double G[3] = {}, S[3] = {}; for (size_t z = 0; z < mean.size(); ++z) { G[z % 3] += mean[z]; S[z % 3] += vm[z]; } double np = double(W) * H;
  // meta is written last: its presence marks a complete chunk
  std::ofstream(pre + "_meta.json") << "{\"spp\": " << spp << ", \"seed\": " << seed << ", \"width\": " << W << ", \"height\": " << H << ", \"seconds\": " << sec << ", \"fault\": \"" << g_fault << "\"}\n";
  printf("%s spp %ld seed %llu %.1fs mean %.7f %.7f %.7f se %.2g %.2g %.2g\n", pre.c_str(), spp, (unsigned long long)seed, sec, G[0] / np, G[1] / np, G[2] / np, std::sqrt(S[0]) / np, std::sqrt(S[1]) / np, std::sqrt(S[2]) / np);
}
