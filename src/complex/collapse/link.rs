//! The link condition: which collapses keep the homotopy type.

use super::CollapseComplex;

impl CollapseComplex {
    /// Whether the link condition `Lk(a) ∩ Lk(b) = Lk(ab)` of the edge `{a, b}` (Dey, Edelsbrunner, Guha, Nekhayev 1999,
    /// *Topology preserving edge contraction*, Publ. Inst. Math. 66) holds after elementary expansions: a weaker condition
    /// under which its collapse still keeps the homotopy type.
    ///
    /// The vertices and edges of `Lk(a) ∩ Lk(b)` form a graph; call its vertices in `Lk(ab)` *roots*.
    /// The condition: each component of the graph is a tree with exactly one root. The link condition
    /// is the special case of a graph without edges.
    ///
    /// Why it suffices: take a vertex `c` of such a tree whose neighbour `d` towards the root has
    /// the face `{a, b, d}`. The faces `{a, c, d}`, `{b, c, d}`, `{a, b, d}` are a tetrahedron
    /// without its interior and the face `{a, b, c}`. Adding these two is an elementary expansion,
    /// which keeps the homotopy type. From the roots outwards all faces `{a, b, c}` can be added like
    /// this; then the link condition holds. The result of the collapse is the same with or without
    /// the added simplices, since their images are in the complex already.
    ///
    /// Cost: the two links, and the square of their intersection.
    pub fn keeps_homotopy(&mut self, a: u32, b: u32) -> bool {
        self.find_shared(a, b);
        // The common neighbours that stay marked have no face with the edge.
        let sides = self.side_pool.get(self.sides[b as usize]);
        for &[p, q] in sides.iter().filter(|side| side.contains(&a)) {
            self.marks.remove(if p == a { q } else { p });
        }
        let Self { marks, shared, .. } = self;
        let around = self.neighbour_pool.get(self.neighbours[b as usize]);
        let mut unreached = around.iter().filter(|&&c| marks.contains(c)).count();
        // A forest with one root per tree has as many edges as vertices that are not roots.
        if unreached != shared.len() {
            return false;
        }
        // Grow from the roots along edges. With the counts equal, reaching every vertex excludes
        // cycles and second roots.
        let mut before = usize::MAX;
        while unreached < before {
            before = unreached;
            for &[c, d] in shared.iter() {
                if marks.contains(c) != marks.contains(d) {
                    marks.remove(c);
                    marks.remove(d);
                    unreached -= 1;
                }
            }
        }
        unreached == 0
    }

    /// The vertices that make [`CollapseComplex::keeps_homotopy`] false for `{a, b}`: it stays false
    /// until a collapse takes one of them, or `a` or `b`. Empty where the condition holds.
    ///
    /// They come from one component that is not a tree with one root. A component keeps its vertices
    /// and edges until one of its vertices, `a` or `b` is part of a collapse, since only then can a
    /// face of `a` or `b` with two of them change. So its own vertices suffice where it has a cycle or
    /// two roots. A tree without a root can still gain one, by a new edge `{c, e}` from one of its
    /// vertices: `e` is then merged from a vertex `x` of a face `{a, c, x}` and a vertex `y` of a face
    /// `{b, c, y}`. So either all such `x` or all such `y` are obstacles, too.
    ///
    /// Cost: as for the condition, and the links of the component.
    pub fn homotopy_obstacles(&mut self, a: u32, b: u32) -> Vec<u32> {
        self.find_shared(a, b);
        let around = self.neighbours(b).iter();
        let mut common: Vec<u32> = around.copied().filter(|&c| self.marks.contains(c)).collect();
        // One component that violates the condition is enough.
        while let Some(first) = common.pop() {
            let (mut component, edges) = self.shared_component(first);
            common.retain(|c| !component.contains(c));
            let roots = component.iter().filter(|&&c| self.has_face(a, b, c)).count();
            let is_tree = edges + 1 == component.len();
            if is_tree && roots == 1 {
                continue;
            }
            if is_tree && roots == 0 {
                for index in 0..component.len() {
                    let [by_a, by_b] = [a, b].map(|end| self.across(component[index], end));
                    component.extend(if by_a.len() <= by_b.len() { by_a } else { by_b });
                }
                component.sort_unstable();
                component.dedup();
            }
            return component;
        }
        Vec::new()
    }

    /// The component of a vertex in the graph of shared sides: its vertices, and its number of sides.
    fn shared_component(&self, first: u32) -> (Vec<u32>, usize) {
        let mut component = vec![first];
        let (mut next, mut ends) = (0, 0);
        while let Some(&c) = component.get(next) {
            next += 1;
            for &[p, q] in self.shared.iter().filter(|side| side.contains(&c)) {
                let other = if p == c { q } else { p };
                ends += 1;
                if !component.contains(&other) {
                    component.push(other);
                }
            }
        }
        // Each side was met from both its ends.
        (component, ends / 2)
    }

    /// The third vertices of the faces at the edge `{v, w}`.
    fn across(&self, v: u32, w: u32) -> Vec<u32> {
        let sides = self.opposite_sides(v).iter().filter(|side| side.contains(&w));
        sides.map(|&[p, q]| if p == w { q } else { p }).collect()
    }
}

// The invariants of a complex under collapse.

/// The first violation that [`CollapseComplex::check`] found, with the vertex or the count.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct CollapseError(String);

impl CollapseComplex {
    /// Verifies every invariant: links that agree with each other, no repetition, no trace of
    /// retired vertices, valid spheres, right counts. Cost quadratic in the degrees; for tests.
    ///
    /// # Errors
    /// The first violation.
    pub fn check(&self) -> Result<(), CollapseError> {
        let (mut spheres, mut neighbours, mut sides) = (0, 0, 0);
        for vertex in 0..self.spheres.len() as u32 {
            if !self.is_alive(vertex) {
                if self.neighbours(vertex).is_empty() && self.opposite_sides(vertex).is_empty() {
                    continue;
                }
                return Err(CollapseError(format!("vertex {vertex} is gone but has a link")));
            }
            self.check_vertex(vertex).map_err(CollapseError)?;
            spheres += 1;
            neighbours += self.neighbours(vertex).len();
            sides += self.opposite_sides(vertex).len();
        }
        // Each edge is named by both ends, each face by all three vertices.
        let counts = [
            ("spheres", self.sphere_count, spheres),
            ("edges", self.edge_count, neighbours / 2),
            ("faces", self.face_count, sides / 3),
        ];
        for (what, kept, counted) in counts {
            if kept != counted {
                let why = format!("{kept} {what} were kept count of, there are {counted}");
                return Err(CollapseError(why));
            }
        }
        Ok(())
    }

    fn check_vertex(&self, vertex: u32) -> Result<(), String> {
        let sphere = self.sphere(vertex);
        if !(sphere.centre.is_finite() && sphere.radius.is_finite() && sphere.radius >= 0.0) {
            return Err(format!("vertex {vertex} has a sphere that is not valid"));
        }
        for &neighbour in self.neighbours(vertex) {
            let mutual = self.is_alive(neighbour) && self.neighbours(neighbour).contains(&vertex);
            if neighbour == vertex || !mutual {
                let names = format!("vertex {vertex} names {neighbour} as a neighbour");
                return Err(format!("{names}, which is gone or does not name it"));
            }
        }
        for &side in self.opposite_sides(vertex) {
            let [p, q] = side;
            let names = |v: u32, a: u32, b: u32| {
                self.is_alive(v) && self.opposite_sides(v).contains(&[a.min(b), a.max(b)])
            };
            let edges = [p, q].iter().all(|v| self.neighbours(vertex).contains(v));
            if p >= q || !edges || !names(p, vertex, q) || !names(q, vertex, p) {
                let names = format!("vertex {vertex} names the side {side:?}");
                return Err(format!("{names}, which is not a face seen from all three"));
            }
        }
        if has_repetition(self.neighbours(vertex)) || has_repetition(self.opposite_sides(vertex)) {
            return Err(format!("the link of vertex {vertex} holds a simplex twice"));
        }
        Ok(())
    }
}

fn has_repetition<T: Ord + Clone>(items: &[T]) -> bool {
    let mut sorted = items.to_vec();
    sorted.sort_unstable();
    sorted.windows(2).any(|pair| pair[0] == pair[1])
}
