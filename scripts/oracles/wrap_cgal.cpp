// CGAL's alpha wrap of a file of triangles or points.
//
//   wrap_cgal IN ALPHA OFFSET OUT.off
//
// ALPHA and OFFSET are fractions of the diagonal of the input's bounding box. Prints vertices, faces and CPU seconds of the
// wrap alone. Polygons are cut into fans, an input without faces is a point set.
#include <CGAL/Bbox_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/IO/polygon_soup_io.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>
#include <CGAL/boost/graph/IO/polygon_mesh_io.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "usage: wrap_cgal IN ALPHA OFFSET OUT.off\n");
    return 2;
  }
  std::vector<Point> points;
  std::vector<std::vector<std::size_t>> polygons;
  if (!CGAL::IO::read_polygon_soup(argv[1], points, polygons) || points.empty()) {
    std::fprintf(stderr, "%s cannot be read\n", argv[1]);
    return 1;
  }
  std::vector<std::array<std::size_t, 3>> triangles;
  for (const auto& polygon : polygons)
    for (std::size_t k = 2; k < polygon.size(); ++k)
      triangles.push_back({polygon[0], polygon[k - 1], polygon[k]});
  CGAL::Bbox_3 box;
  if (triangles.empty()) {
    for (const auto& p : points) box += p.bbox();
  } else {
    for (const auto& t : triangles)
      for (const std::size_t v : t) box += points[v].bbox();
  }
  const double diagonal = std::sqrt(CGAL::square(box.xmax() - box.xmin()) + CGAL::square(box.ymax() - box.ymin()) +
                                    CGAL::square(box.zmax() - box.zmin()));
  const double alpha = std::atof(argv[2]) * diagonal, offset = std::atof(argv[3]) * diagonal;
  CGAL::Surface_mesh<Point> wrap;
  const std::clock_t start = std::clock();
  if (triangles.empty()) {
    CGAL::alpha_wrap_3(points, alpha, offset, wrap);
  } else {
    CGAL::alpha_wrap_3(points, triangles, alpha, offset, wrap);
  }
  const double seconds = double(std::clock() - start) / CLOCKS_PER_SEC;
  std::printf("%zu %zu %.3f\n", std::size_t(num_vertices(wrap)), std::size_t(num_faces(wrap)), seconds);
  return CGAL::IO::write_polygon_mesh(argv[4], wrap, CGAL::parameters::stream_precision(17)) ? 0 : 1;
}
