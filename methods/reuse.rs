//! Results that a search over levels reuses from earlier requests, and the seconds of a request as if
//! it had been made alone.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use medial::shape::Cost;
use medial::simplifier::Work;

/// Values by key, each made once, with what making it cost.
pub(crate) struct Reuse<K, T> {
    made: BTreeMap<K, (Arc<T>, Cost)>,
    /// Keys that the current request has asked for.
    asked: BTreeSet<K>,
    /// The cost of those of them that were made for earlier requests.
    earlier: Option<Cost>,
}

impl<K: Ord + Copy, T> Reuse<K, T> {
    pub(crate) fn new() -> Self {
        Self { made: BTreeMap::new(), asked: BTreeSet::new(), earlier: None }
    }

    /// Begins a request: nothing has been asked for yet.
    pub(crate) fn begin(&mut self) {
        self.asked.clear();
        self.earlier = None;
    }

    /// The value of a key, made now unless it is there.
    pub(crate) fn get<E>(
        &mut self,
        key: K,
        make: impl FnOnce() -> Result<T, E>,
    ) -> Result<Arc<T>, E> {
        let is_new = self.asked.insert(key);
        if let Some((value, cost)) = self.made.get(&key) {
            if is_new {
                *self.earlier.get_or_insert_default() += *cost;
            }
            return Ok(Arc::clone(value));
        }
        let (value, cost) = Cost::of(make);
        let value = Arc::new(value?);
        self.made.insert(key, (Arc::clone(&value), cost));
        Ok(value)
    }

    /// How much of the request had been done before it.
    pub(crate) fn work(&self) -> Work {
        self.earlier.map_or(Work::Anew, Work::Reused)
    }

    /// Number of values there are.
    #[cfg(test)]
    pub(crate) fn len(&self) -> usize {
        self.made.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_costs_what_it_would_have_cost_alone() {
        let mut reuse: Reuse<u32, u32> = Reuse::new();
        let mut request = |keys: &[u32]| {
            reuse.begin();
            let mut made = Vec::new();
            for &key in keys {
                let make = || {
                    made.push(key);
                    let busy = (0..200_000 * key).fold(0_u64, |a, b| a ^ u64::from(b));
                    Ok::<u32, ()>(std::hint::black_box(busy) as u32)
                };
                reuse.get(key, make).expect("made");
            }
            (made, reuse.work(), reuse.made.clone())
        };
        // A value made by the request itself is in its own time, however often it is asked for.
        let (made, work, _) = request(&[1, 2, 1]);
        assert_eq!((made, work), (vec![1, 2], Work::Anew));
        let (made, work, costs) = request(&[2, 3, 2, 1]);
        assert_eq!(made, [3]);
        let mut expected = costs[&2].1;
        expected += costs[&1].1;
        assert_eq!(work, Work::Reused(expected));
        let (made, work, _) = request(&[4]);
        assert_eq!((made, work), (vec![4], Work::Anew));
    }

    #[test]
    fn what_fails_is_made_again() {
        let mut reuse: Reuse<u32, u32> = Reuse::new();
        assert_eq!(reuse.get(1, || Err("no")), Err("no"));
        assert_eq!(reuse.get(1, || Ok::<_, &str>(5)).map(|value| *value), Ok(5));
        assert_eq!((reuse.work(), reuse.len()), (Work::Anew, 1));
    }
}
