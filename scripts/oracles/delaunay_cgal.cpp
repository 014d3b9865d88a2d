// The other side of the comparison: CGAL's Delaunay or regular triangulation of a file of points.
//
//   delaunay_cgal FILE [REPEAT] [weighted | parallel]
//
// FILE holds 4 little-endian doubles for each point: x, y, z, weight. Prints the number of finite
// cells, an order-free hash of their vertices' coordinates, the best CPU seconds of the main
// thread (elapsed seconds if parallel), and the growth of the peak of resident memory in KiB.
#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Regular_triangulation_3.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Delaunay = CGAL::Delaunay_triangulation_3<Kernel>;
using Regular = CGAL::Regular_triangulation_3<Kernel>;
using Records = std::vector<std::array<double, 4>>;

#ifdef CGAL_LINKED_WITH_TBB
using ParallelDelaunay = CGAL::Delaunay_triangulation_3<
    Kernel,
    CGAL::Triangulation_data_structure_3<CGAL::Triangulation_vertex_base_3<Kernel>,
                                         CGAL::Delaunay_triangulation_cell_base_3<Kernel>,
                                         CGAL::Parallel_tag>>;
#endif

static uint64_t mix(uint64_t x) {
  x = (x ^ (x >> 33)) * 0xff51afd7ed558ccdULL;
  x = (x ^ (x >> 33)) * 0xc4ceb9fe1a85ec53ULL;
  return x ^ (x >> 33);
}

static uint64_t absorb(uint64_t h, double x) {
  uint64_t bits;
  x += 0.0;  // -0.0 is the same position as 0.0
  std::memcpy(&bits, &x, sizeof bits);
  return mix(h ^ bits);
}

static uint64_t hash_point(const Kernel::Point_3& p) {
  return absorb(absorb(absorb(1, p.x()), p.y()), p.z());
}
static uint64_t hash_point(const Kernel::Weighted_point_3& p) { return hash_point(p.point()); }

static Records read(const char* file) {
  std::ifstream in(file, std::ios::binary | std::ios::ate);
  if (!in) {
    std::fprintf(stderr, "cannot read %s\n", file);
    std::exit(1);
  }
  Records records(in.tellg() / sizeof(Records::value_type));
  in.seekg(0);
  in.read(reinterpret_cast<char*>(records.data()), records.size() * sizeof(Records::value_type));
  return records;
}

static bool elapsed = false;

static double seconds() {
  timespec t;
  clock_gettime(elapsed ? CLOCK_MONOTONIC : CLOCK_THREAD_CPUTIME_ID, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}

static long peak_kib() {
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);)
    if (line.rfind("VmHWM:", 0) == 0) return std::stol(line.substr(6));
  return 0;
}

template <class Triangulation, class Points, class Make>
static void run(const Points& points, int repeat, Make make) {
  const long before = peak_kib();
  double best = 1e300;
  std::unique_ptr<Triangulation> t;
  for (int i = 0; i < repeat; ++i) {
    t.reset();
    const double start = seconds();
    t = make(points);
    best = std::min(best, seconds() - start);
  }
  const long after = peak_kib();
  uint64_t set = 0;
  size_t cells = 0;
  for (auto c = t->finite_cells_begin(); c != t->finite_cells_end(); ++c, ++cells) {
    uint64_t v[4];
    for (int i = 0; i < 4; ++i) v[i] = hash_point(c->vertex(i)->point());
    std::sort(v, v + 4);
    uint64_t h = 0;
    for (uint64_t x : v) h = mix(h ^ x);
    set += h;
  }
  std::printf("%zu %016llx %.4f %ld\n", cells, static_cast<unsigned long long>(set), best,
              after - before);
}

template <class Triangulation, class Points>
static std::unique_ptr<Triangulation> build(const Points& points) {
  return std::make_unique<Triangulation>(points.begin(), points.end());
}

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: delaunay_cgal FILE [REPEAT] [weighted | parallel]\n");
    return 2;
  }
  const Records records = read(argv[1]);
  const int repeat = argc > 2 ? std::max(1, std::atoi(argv[2])) : 1;
  const std::string mode = argc > 3 ? argv[3] : "";
  if (mode == "weighted") {
    std::vector<Kernel::Weighted_point_3> points;
    for (const auto& r : records)
      points.emplace_back(Kernel::Point_3(r[0], r[1], r[2]), r[3]);
    run<Regular>(points, repeat, build<Regular, decltype(points)>);
    return 0;
  }
  std::vector<Kernel::Point_3> points;
  for (const auto& r : records) points.emplace_back(r[0], r[1], r[2]);
  if (mode == "parallel") {
#ifdef CGAL_LINKED_WITH_TBB
    elapsed = true;
    CGAL::Bbox_3 box;
    for (const auto& p : points) box += p.bbox();
    run<ParallelDelaunay>(points, repeat, [&](const auto& p) {
      ParallelDelaunay::Lock_data_structure locks(box, 50);
      return std::make_unique<ParallelDelaunay>(p.begin(), p.end(), &locks);
    });
    return 0;
#else
    std::fprintf(stderr, "built without TBB\n");
    return 1;
#endif
  }
  run<Delaunay>(points, repeat, build<Delaunay, decltype(points)>);
}
