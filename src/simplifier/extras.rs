//! What only some methods give, kept by type.

use std::any::{Any, TypeId, type_name};
use std::fmt;
use std::sync::Arc;

/// What a method gives beside the medial mesh: at most one value of each type.
///
/// A method that has voxels, named parts or a hierarchy defines their type, or takes one that
/// exists, and announces it in [`MethodInfo::extras`](super::MethodInfo::extras). Whoever knows the
/// type can ask for it; everybody else passes it on. Clones share the values.
///
/// ```
/// use medial::simplifier::Extras;
///
/// struct Seams(Vec<[u32; 2]>);
/// let extras = Extras::with(Seams(vec![[0, 1]]));
/// assert_eq!(extras.get::<Seams>().map(|seams| seams.0.len()), Some(1));
/// assert!(extras.get::<String>().is_none());
/// ```
#[derive(Clone, Default)]
pub struct Extras {
    /// In the order of insertion. A handful at most: a map would cost more than the search.
    entries: Vec<Entry>,
}

#[derive(Clone)]
struct Entry {
    key: TypeId,
    name: &'static str,
    value: Arc<dyn Any + Send + Sync>,
}

impl Extras {
    /// One value.
    pub fn with<T: Any + Send + Sync>(value: T) -> Self {
        let mut extras = Self::default();
        extras.insert(value);
        extras
    }

    /// Adds a value in place of an earlier one of the same type.
    pub fn insert<T: Any + Send + Sync>(&mut self, value: T) {
        self.insert_shared(Arc::new(value));
    }

    /// As [`Extras::insert`], for a value that others hold too. It is found as a `T`.
    pub fn insert_shared<T: Any + Send + Sync>(&mut self, value: Arc<T>) {
        let key = TypeId::of::<T>();
        self.entries.retain(|entry| entry.key != key);
        self.entries.push(Entry { key, name: type_name::<T>(), value });
    }

    /// The value of a type, if there is one.
    pub fn get<T: Any + Send + Sync>(&self) -> Option<&T> {
        self.find::<T>().and_then(|value| value.downcast_ref())
    }

    /// The value of a type to hold on to, if there is one.
    pub fn get_shared<T: Any + Send + Sync>(&self) -> Option<Arc<T>> {
        self.find::<T>().and_then(|value| Arc::clone(value).downcast().ok())
    }

    fn find<T: Any>(&self) -> Option<&Arc<dyn Any + Send + Sync>> {
        let key = TypeId::of::<T>();
        self.entries.iter().find(|entry| entry.key == key).map(|entry| &entry.value)
    }
}

impl fmt::Debug for Extras {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.entries.iter().map(|entry| entry.name)).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_found_by_its_type_and_replaced_by_a_later_one() {
        let mut extras = Extras::with(1_u32);
        extras.insert_shared(Arc::new("two".to_owned()));
        assert_eq!(extras.get::<u32>(), Some(&1));
        extras.insert(3_u32);
        let copy = extras.clone();
        assert_eq!((copy.get::<u32>(), copy.get::<u64>()), (Some(&3), None));
        assert_eq!(copy.get_shared::<String>().as_deref().map(String::as_str), Some("two"));
        assert_eq!(format!("{copy:?}"), r#"{"alloc::string::String", "u32"}"#);
    }
}
