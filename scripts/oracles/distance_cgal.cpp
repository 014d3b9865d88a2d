// The other side of the comparison: CGAL's closest points and inside test on a file of a mesh with
// queries.
//
//   distance_cgal FILE MODE ANSWERS
//
// FILE and ANSWERS as in src/bin/distance_oracle.rs. Modes:
//   closest         AABB_tree of triangles, exact predicates; its internal k-d tree gives the start
//   closest-simple  the same with Simple_cartesian<double>
//   closest-hinted  the same as closest-simple, queries along a Hilbert curve, each starting from the
//                   answer before
//   inside, inside-hard  Side_of_triangle_mesh, exact predicates
//
// Prints CPU seconds for the queries and for everything before them. Trees are built, and warmed
// by one query, before the clock starts.
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Spatial_sort_traits_adapter_3.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/property_map.h>
#include <CGAL/spatial_sort.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <numeric>
#include <string>
#include <vector>

using Triple = std::array<double, 3>;
using Face = std::array<uint32_t, 3>;

struct Task {
  std::vector<Triple> vertices;
  std::vector<Face> faces;
  std::vector<Triple> queries[3];  // inside, around, degenerate
};

template <class T>
static void take(std::istream& in, std::vector<T>& values, uint64_t count) {
  values.resize(count);
  in.read(reinterpret_cast<char*>(values.data()), count * sizeof(T));
}

static Task read(const char* file) {
  std::ifstream in(file, std::ios::binary);
  uint64_t counts[3];
  Task task;
  in.read(reinterpret_cast<char*>(counts), sizeof counts);
  if (in) {
    take(in, task.vertices, counts[0]);
    take(in, task.faces, counts[1]);
    for (auto& queries : task.queries) take(in, queries, counts[2]);
  }
  if (!in) {
    std::fprintf(stderr, "cannot read %s\n", file);
    std::exit(1);
  }
  return task;
}

static double seconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}

struct Answers {
  double before, queries;
  std::vector<double> values;
};

template <class Kernel>
static Answers closest(const Task& task, bool hinted) {
  using Point = typename Kernel::Point_3;
  using Triangles = std::vector<typename Kernel::Triangle_3>;
  using Primitive = CGAL::AABB_triangle_primitive<Kernel, typename Triangles::iterator>;
  using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;
  const auto point = [](const Triple& p) { return Point(p[0], p[1], p[2]); };
  Triangles triangles;
  for (const auto& f : task.faces)
    triangles.emplace_back(point(task.vertices[f[0]]), point(task.vertices[f[1]]),
                           point(task.vertices[f[2]]));
  std::vector<Point> queries;
  for (const auto& q : task.queries[0]) queries.push_back(point(q));
  Answers answers;
  const double start = seconds();
  Tree tree(triangles.begin(), triangles.end());
  tree.build();
  tree.closest_point(queries.front());
  answers.before = seconds() - start;
  answers.values.resize(4 * queries.size());
  const auto answer = [&](std::size_t k, const Point& c) {
    const double squared = CGAL::squared_distance(queries[k], c);
    double* row = &answers.values[4 * k];
    row[0] = c.x(), row[1] = c.y(), row[2] = c.z(), row[3] = std::sqrt(squared);
  };
  const double built = seconds();
  if (hinted) {
    std::vector<std::size_t> order(queries.size());
    std::iota(order.begin(), order.end(), 0);
    const auto map = CGAL::make_property_map(queries);
    CGAL::spatial_sort(order.begin(), order.end(),
                       CGAL::Spatial_sort_traits_adapter_3<Kernel, decltype(map)>(map));
    auto hint = tree.closest_point_and_primitive(queries[order.front()]);
    for (const std::size_t k : order) {
      hint = tree.closest_point_and_primitive(queries[k], hint);
      answer(k, hint.first);
    }
  } else {
    for (std::size_t k = 0; k < queries.size(); ++k) answer(k, tree.closest_point(queries[k]));
  }
  answers.queries = seconds() - built;
  return answers;
}

static Answers inside(const Task& task, const std::vector<Triple>& queries) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
  Mesh mesh;
  std::vector<Mesh::Vertex_index> ids;
  for (const auto& p : task.vertices)
    ids.push_back(mesh.add_vertex(Kernel::Point_3(p[0], p[1], p[2])));
  for (const auto& f : task.faces)
    if (mesh.add_face(ids[f[0]], ids[f[1]], ids[f[2]]) == Mesh::null_face()) {
      std::fprintf(stderr, "the mesh is not manifold\n");
      std::exit(1);
    }
  std::vector<Kernel::Point_3> points;
  for (const auto& q : queries) points.emplace_back(q[0], q[1], q[2]);
  Answers answers;
  const double start = seconds();
  CGAL::Side_of_triangle_mesh<Mesh, Kernel> side(mesh);
  side(points.front());
  answers.before = seconds() - start;
  answers.values.reserve(points.size());
  const double built = seconds();
  for (const auto& p : points) {
    const auto s = side(p);
    answers.values.push_back(s == CGAL::ON_BOUNDED_SIDE ? 1 : s == CGAL::ON_BOUNDARY ? 0 : -1);
  }
  answers.queries = seconds() - built;
  return answers;
}

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: distance_cgal FILE MODE ANSWERS\n");
    return 2;
  }
  const Task task = read(argv[1]);
  const std::string mode = argv[2];
  Answers answers;
  if (mode == "closest") {
    answers = closest<CGAL::Exact_predicates_inexact_constructions_kernel>(task, false);
  } else if (mode == "closest-simple" || mode == "closest-hinted") {
    answers = closest<CGAL::Simple_cartesian<double>>(task, mode == "closest-hinted");
  } else if (mode == "inside" || mode == "inside-hard") {
    answers = inside(task, task.queries[mode == "inside" ? 1 : 2]);
  } else {
    std::fprintf(stderr, "unknown mode %s\n", mode.c_str());
    return 2;
  }
  std::printf("%.4f %.4f\n", answers.queries, answers.before);
  std::ofstream(argv[3], std::ios::binary)
      .write(reinterpret_cast<const char*>(answers.values.data()), answers.values.size() * 8);
}
