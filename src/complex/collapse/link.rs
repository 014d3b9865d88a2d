//! The link condition: which collapses keep the homotopy type.

use super::CollapseComplex;

impl CollapseComplex {
    /// Whether `Lk(a) ∩ Lk(b) = Lk(ab)` for the edge `{a, b}`: then its collapse keeps the homotopy
    /// type of the complex.
    ///
    /// In a complex of dimension two these are two tests:
    /// - T1: every vertex `c` adjacent to both ends forms a face `{a, b, c}`; otherwise a hole
    ///   bounded by three edges closes.
    /// - T2: no edge `{c, d}` has both faces `{a, c, d}` and `{b, c, d}`; otherwise a void bounded
    ///   by faces closes.
    ///
    /// Source: Dey, Edelsbrunner, Guha, Nekhayev 1999, *Topology preserving edge contraction*,
    /// Publ. Inst. Math. 66. Cost: the two links.
    pub fn link_condition(&mut self, a: u32, b: u32) -> bool {
        self.link_obstacle(a, b).is_none()
    }

    /// What violates the link condition of `{a, b}`: `[c, c]` for a vertex that fails T1, `[c, d]`
    /// for an edge that fails T2. While neither was part of a collapse, nor `a` and `b`, the
    /// condition stays violated. Cost: the two links.
    pub fn link_obstacle(&mut self, a: u32, b: u32) -> Option<[u32; 2]> {
        self.find_shared(a, b);
        if let Some(&side) = self.shared.first() {
            return Some(side);
        }
        // Unmark the third vertices of the faces at the edge: a common neighbour left is a hole.
        let sides = self.side_pool.get(self.sides[b as usize]);
        for &[p, q] in sides.iter().filter(|side| side.contains(&a)) {
            self.marks.remove(if p == a { q } else { p });
        }
        let hole = self.neighbours(b).iter().find(|&&c| self.marks.contains(c));
        hole.map(|&c| [c, c])
    }

    /// Whether the link condition holds after elementary expansions: a weaker condition on the edge
    /// `{a, b}` under which its collapse still keeps the homotopy type.
    ///
    /// The vertices of `Lk(a) ∩ Lk(b)` and its edges are a graph, in which the vertices of `Lk(ab)`
    /// are the *roots*. The condition is that each component of it is a tree with exactly one root.
    /// The link condition is the case without edges.
    ///
    /// Why it suffices: take a vertex `c` of such a tree whose neighbour `d` towards the root has
    /// the face `{a, b, d}`. The faces `{a, c, d}`, `{b, c, d}`, `{a, b, d}` are a tetrahedron but
    /// for its interior and the face `{a, b, c}`; adding these two is an elementary expansion, which
    /// keeps the homotopy type. From the roots outwards all faces `{a, b, c}` are added so, and then
    /// the link condition holds. The collapse makes the same complex with these simplices as
    /// without: its image of `{a, b, c}` and of the tetrahedron is there already.
    ///
    /// Cost: the two links, and the square of what they share.
    pub fn keeps_homotopy(&mut self, a: u32, b: u32) -> bool {
        self.find_shared(a, b);
        let Self { marks, shared, .. } = self;
        let sides = self.side_pool.get(self.sides[b as usize]);
        for &[p, q] in sides.iter().filter(|side| side.contains(&a)) {
            marks.remove(if p == a { q } else { p });
        }
        let around = self.neighbour_pool.get(self.neighbours[b as usize]);
        let mut unreached = around.iter().filter(|&&c| marks.contains(c)).count();
        // As many edges as vertices that are no roots: trees if all are reached, cycles if not.
        if unreached != shared.len() {
            return false;
        }
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
}
