//! Disjoint sets of consecutive ids.
//!
//! By hand because the representative is the smallest member, for any order of the joins; that of
//! `petgraph` depends on ranks.

/// A partition of `0..n` whose sets can be joined. The representative of a set is its smallest member.
#[derive(Clone, Debug)]
pub struct DisjointSets {
    parent: Vec<u32>,
    sets: usize,
}

impl DisjointSets {
    /// The partition of `0..n` into single members.
    ///
    /// # Panics
    /// If `n` does not fit into 32 bits.
    pub fn singletons(n: usize) -> Self {
        let n = u32::try_from(n).expect("ids have 32 bits");
        Self { parent: (0..n).collect(), sets: n as usize }
    }

    /// The smallest member of the set of `member`; nearly constant time.
    ///
    /// # Panics
    /// If `member` is out of range.
    pub fn find(&mut self, mut member: u32) -> u32 {
        while self.parent[member as usize] != member {
            // Path halving: short paths without a second pass.
            let grandparent = self.parent[self.parent[member as usize] as usize];
            self.parent[member as usize] = grandparent;
            member = grandparent;
        }
        member
    }

    /// Joins the sets of two members; false if they were the same set already.
    ///
    /// # Panics
    /// If a member is out of range.
    pub fn join(&mut self, a: u32, b: u32) -> bool {
        let (a, b) = (self.find(a), self.find(b));
        if a != b {
            // By index and not by rank: representatives must not depend on the order of joins.
            self.parent[a.max(b) as usize] = a.min(b);
            self.sets -= 1;
        }
        a != b
    }

    /// Number of sets.
    pub fn len(&self) -> usize {
        self.sets
    }

    /// Whether there is no member at all.
    pub fn is_empty(&self) -> bool {
        self.parent.is_empty()
    }
}
