//! The files that our oracles exchange with CGAL and Open3D: little-endian numbers without padding.

use std::error::Error;
use std::f64::consts::TAU;

use medial::Vec3;
use medial::surface::TriMesh;

/// A mesh and the query points, three kinds of as many each.
///
/// In a file: the counts of vertices, faces and queries of one kind (u64), vertices (3 f64), faces (3 u32), the three
/// kinds of queries (3 f64).
pub struct Task {
    /// The surface.
    pub mesh: TriMesh,
    /// Points inside, points of the bounding box, degenerate points.
    pub queries: [Vec<Vec3>; 3],
}

impl Task {
    /// Writes the file.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, file: &str) -> std::io::Result<()> {
        let mut out = Vec::new();
        for count in [self.mesh.vertices.len(), self.mesh.faces.len(), self.queries[0].len()] {
            out.extend((count as u64).to_le_bytes());
        }
        out.extend(bytes_of(&self.mesh.vertices));
        out.extend(self.mesh.faces.iter().flatten().flat_map(|v| v.to_le_bytes()));
        self.queries.iter().for_each(|kind| out.extend(bytes_of(kind)));
        std::fs::write(file, out)
    }

    /// Reads the file.
    ///
    /// # Errors
    /// When it cannot be read, or is too short for its counts.
    pub fn read(file: &str) -> Result<Self, Box<dyn Error>> {
        let content = std::fs::read(file)?;
        let (head, rest) = content.split_at_checked(24).ok_or("the file has no counts")?;
        let [vertices, faces, queries] =
            [0, 8, 16].map(|at| u64::from_le_bytes(std::array::from_fn(|i| head[at + i])) as usize);
        let ends = [24 * vertices, 24 * vertices + 12 * faces];
        if rest.len() < ends[1] + 3 * 24 * queries {
            return Err(format!("{file} is too short").into());
        }
        let ids = rest[ends[0]..ends[1]].chunks_exact(4);
        let ids: Vec<u32> = ids.map(|c| u32::from_le_bytes([c[0], c[1], c[2], c[3]])).collect();
        let mesh = TriMesh {
            vertices: points(&numbers(&rest[..ends[0]])),
            faces: ids.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
        };
        let all = points(&numbers(&rest[ends[1]..]));
        let queries = [0, 1, 2].map(|kind| all[kind * queries..(kind + 1) * queries].to_vec());
        Ok(Self { mesh, queries })
    }
}

fn bytes_of(points: &[Vec3]) -> Vec<u8> {
    bytes(points.iter().flat_map(|p| p.to_array()))
}

/// Numbers as they stand in files.
pub fn bytes(numbers: impl IntoIterator<Item = f64>) -> Vec<u8> {
    numbers.into_iter().flat_map(f64::to_le_bytes).collect()
}

/// The numbers of a file.
pub fn numbers(bytes: &[u8]) -> Vec<f64> {
    bytes.chunks_exact(8).map(|c| f64::from_le_bytes(c.try_into().unwrap_or_default())).collect()
}

/// Three numbers for each point.
pub fn points(numbers: &[f64]) -> Vec<Vec3> {
    numbers.chunks_exact(3).map(|c| Vec3::new(c[0], c[1], c[2])).collect()
}

/// CPU seconds of all threads of this process.
pub fn cpu_seconds() -> f64 {
    cpu_time::ProcessTime::try_now().map_or(0.0, |t| t.as_duration().as_secs_f64())
}

/// A closed mesh of `2 n^2` triangles: a tube with bumps, bent to a ring.
pub fn bumpy_torus(n: u32) -> TriMesh {
    let angle = |k: u32| TAU * f64::from(k) / f64::from(n);
    let point = |k: u32| {
        let (u, v) = (angle(k / n), angle(k % n));
        let tube = 0.35 + 0.05 * (5.0 * u).sin() * (4.0 * v).cos();
        let ring = 1.0 + tube * v.cos();
        Vec3::new(ring * u.cos(), ring * u.sin(), tube * v.sin())
    };
    let id = |i: u32, j: u32| i % n * n + j % n;
    let sides = (0..n * n).flat_map(|k| {
        let (i, j) = (k / n, k % n);
        let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    TriMesh { vertices: (0..n * n).map(point).collect(), faces: sides.collect() }
}
