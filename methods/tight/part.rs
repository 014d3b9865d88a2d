//! The simplices around the spheres that move, as a mesh that is evaluated alone.

use medial::complex::{MedialMesh, Primitive, Sphere};

/// The simplices with a moving corner, as a mesh of their own.
pub(super) struct Part {
    pub mesh: MedialMesh,
    /// The places of its spheres in the whole mesh.
    pub spheres: Vec<u32>,
    /// Which of its spheres stay.
    pub fixed: Vec<bool>,
}

impl Part {
    pub fn of(mesh: &MedialMesh, moving: &[bool]) -> Self {
        let is_moving = |v: &u32| moving[*v as usize];
        let edges: Vec<_> = mesh.edges.iter().filter(|e| e.iter().any(is_moving)).collect();
        let faces: Vec<_> = mesh.faces.iter().filter(|f| f.iter().any(is_moving)).collect();
        let mut used = moving.to_vec();
        edges.iter().for_each(|e| e.iter().for_each(|&v| used[v as usize] = true));
        faces.iter().for_each(|f| f.iter().for_each(|&v| used[v as usize] = true));
        // The side of a face opposite to its moving corner is part of the rest.
        let sides = mesh.edges.iter().filter(|&&[a, b]| {
            !is_moving(&a)
                && !is_moving(&b)
                && used[a as usize]
                && used[b as usize]
                && faces.iter().any(|f| f.contains(&a) && f.contains(&b))
        });
        let mut kept: Vec<[u32; 2]> = edges.into_iter().chain(sides).copied().collect();
        kept.sort_unstable();
        let spheres: Vec<u32> = (0..used.len() as u32).filter(|&v| used[v as usize]).collect();
        let mut place = vec![0; used.len()];
        for (new, &v) in (0..).zip(&spheres) {
            place[v as usize] = new;
        }
        let edges = kept.into_iter().map(|e| e.map(|v| place[v as usize])).collect();
        let faces = faces.into_iter().map(|f| f.map(|v| place[v as usize])).collect();
        let fixed = spheres.iter().map(|v| !is_moving(v)).collect();
        let own: Vec<Sphere> = spheres.iter().map(|&v| mesh.spheres[v as usize]).collect();
        let mesh = MedialMesh { spheres: own, edges, faces, contacts: None };
        Self { mesh, spheres, fixed }
    }

    /// A primitive of the part, as one of the whole mesh.
    pub fn in_whole(&self, whole: &MedialMesh, primitive: Primitive) -> Primitive {
        let found = |place: Option<usize>| place.expect("the part is of the whole") as u32;
        match primitive {
            Primitive::Sphere(v) => Primitive::Sphere(self.spheres[v as usize]),
            Primitive::Edge(e) => {
                let edge = self.mesh.edges[e as usize].map(|v| self.spheres[v as usize]);
                Primitive::Edge(found(whole.edges.binary_search(&edge).ok()))
            }
            Primitive::Face(f) => {
                let face = self.mesh.faces[f as usize].map(|v| self.spheres[v as usize]);
                Primitive::Face(found(whole.faces.binary_search(&face).ok()))
            }
        }
    }
}
