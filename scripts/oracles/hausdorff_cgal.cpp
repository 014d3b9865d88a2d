// CGAL's bounds on the Hausdorff distances between two closed triangle meshes, both ways.
//
//   hausdorff_cgal A.off B.off ERROR
//
// Prints bounded_error_Hausdorff_distance(A, B) and (B, A): each is at most ERROR away from the exact
// distance.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/distance.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/IO/polygon_soup_io.h>
#include <CGAL/Surface_mesh.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
namespace PMP = CGAL::Polygon_mesh_processing;

// A decimated surface may be torn: read as a soup, its non-manifold vertices taken apart.
static Mesh read(const char* file) {
  std::vector<Kernel::Point_3> points;
  std::vector<std::vector<std::size_t>> faces;
  if (!CGAL::IO::read_polygon_soup(file, points, faces)) {
    std::fprintf(stderr, "%s cannot be read\n", file);
    std::exit(1);
  }
  PMP::orient_polygon_soup(points, faces);
  Mesh mesh;
  PMP::polygon_soup_to_polygon_mesh(points, faces, mesh);
  return mesh;
}

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: hausdorff_cgal A.off B.off ERROR\n");
    return 2;
  }
  const Mesh a = read(argv[1]), b = read(argv[2]);
  const double error = std::atof(argv[3]);
  std::printf("%.17g %.17g\n", PMP::bounded_error_Hausdorff_distance<CGAL::Sequential_tag>(a, b, error),
              PMP::bounded_error_Hausdorff_distance<CGAL::Sequential_tag>(b, a, error));
}
