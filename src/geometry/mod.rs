//! Exact predicates, Delaunay triangulation, bounding-volume trees, distances to medial primitives.
