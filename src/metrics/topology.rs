//! The warning about Betti numbers that differ from the solid's.

/// A sentence about the difference, if the Betti numbers of a medial mesh are not the solid's.
///
/// ```
/// use medial::metrics::topology_warning;
///
/// assert_eq!(topology_warning([1, 0, 0], Some([1, 0, 0])), None);
/// let hole = topology_warning([1, 1, 0], Some([1, 0, 0])).unwrap();
/// assert!(hole.contains("[1, 1, 0]"));
/// ```
pub fn topology_warning(found: [u64; 3], expected: Option<[u64; 3]>) -> Option<String> {
    let expected = expected.filter(|&expected| expected != found)?;
    let of = |k: usize, one: &str, many: &str| {
        let (more, less) =
            (found[k].saturating_sub(expected[k]), expected[k].saturating_sub(found[k]));
        let (number, what) = if more > 0 { (more, "too many") } else { (less, "missing") };
        (number > 0).then(|| format!("{number} {} {what}", if number == 1 { one } else { many }))
    };
    let parts = [
        of(0, "component", "components"),
        of(1, "tunnel", "tunnels"),
        of(2, "closed pocket", "closed pockets"),
    ];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    Some(format!("the Betti numbers are {found:?}, the solid's {expected:?}: {}", parts.join(", ")))
}
