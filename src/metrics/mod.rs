//! What a medial mesh is judged by: Hausdorff distances, triangle quality, spikes, topology.
