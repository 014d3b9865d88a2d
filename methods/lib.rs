//! The published simplifiers of the medial axis, one module each, and two of this project.
//!
//! Every method implements [`medial::simplifier::MedialSimplifier`] and knows neither the others
//! nor the runner. [`registry`] lists them in the order of every table.

use medial::simplifier::{MedialSimplifier, Registered, Simplification, SimplifyError};

pub mod angle;
pub mod aof;
pub mod cover;
pub mod coverage_axis;
pub mod dey_zhao;
pub mod hem;
pub mod initial;
pub mod lambda;
mod levels;
pub mod pmat;
pub mod qmat;
mod quadric;
mod ranked;
pub mod sat;
pub mod sat_pairwise;
pub mod sphere_mesh;
pub mod tam_heidrich;
pub mod tight;
pub mod vmas;

/// The result of a method, or of a part of one.
pub type Result<T, E = SimplifyError> = std::result::Result<T, E>;

/// A method on one shape, ready for levels.
type Prepared<'s> = Result<Box<dyn Simplification + 's>>;

/// All methods, in the order of the tables. Some are marked to run only when named.
pub fn registry() -> Vec<Registered> {
    let methods = vec![
        Registered::from(angle::method())
            .best_for(
                "Removing spikes of any size from the axis of dense samples, where \
                 thousands of spheres may stay.",
            )
            .sweep(&[30.0, 60.0, 120.0]),
        Registered::from(lambda::method())
            .best_for(
                "Removing features by absolute size from the axis of dense samples, \
                 with a proof that the rest is stable.",
            )
            .sweep(&[0.01, 0.02]),
        Registered::from(dey_zhao::method())
            .best_for(
                "An axis of dense samples of any shape, without a parameter to \
                 tune.",
            )
            .sweep(&[1.0, 2.0, 3.0]),
        Registered::from(qmat::method()).best_for(
            "A small number of spheres in about a second, each placed where its \
             error is least.",
        ),
        Registered::from(pmat::method())
            .best_for("All levels from one run, nested and without a parameter.")
            .sweep(&[2.0, 4.0, 8.0]),
        Registered::from(hem::method())
            .best_for(
                "Few spheres for a given error where speed matters less, usually \
                 fewer than Q-MAT needs.",
            )
            .sweep(&[0.01, 0.02, 0.04]),
        Registered::from(sat::method())
            .best_for(
                "Removing features that are small for their surroundings, while \
                 equally small ones elsewhere stay.",
            )
            .sweep(&[1.1, 1.5, 2.0]),
        Registered::from(sat_pairwise::method()).sweep(&[1.1, 1.5, 2.0]).on_request(),
        Registered::from(tam_heidrich::method())
            .best_for("Removing whole features of little volume, while loops stay.")
            .sweep(&[1.0, 5.0]),
        Registered::from(aof::method())
            .best_for(
                "An axis of thousands of spheres straight from the surface, where \
                 its samples give too poor a start.",
            )
            .sweep(&[15.0, 30.0, 60.0]),
        Registered::from(coverage_axis::method())
            .best_for(
                "Some tens of spheres as a skeleton, each where the medial axis has \
                 it.",
            )
            .sweep(&[0.01, 0.02, 0.05]),
        Registered::from(sphere_mesh::method())
            .best_for("A few spheres straight from a dense surface, without a medial axis.")
            .on_request(),
        Registered::from(vmas::method())
            .best_for("Up to a few hundred evenly spread spheres of an organic shape.")
            .on_request(),
        Registered::from(tight::method(qmat::method())).best_for(
            "The least two-sided error with few spheres, for 4 to 27 CPU \
             seconds a count up to 500.",
        ),
        Registered::from(cover::method())
            .best_for(
                "Spheres alone as in collision models, with a certified bound of \
                 the deviation.",
            )
            .on_request(),
    ];
    methods
        .into_iter()
        .map(|registered| {
            let version = version(&registered.method.info().id);
            Registered { version: version.map(Into::into), ..registered }
        })
        .collect()
}

/// A text that changes whenever the sources that decide the results of a method do: its module, the
/// modules of the methods that [`registry`] builds it from, the shared modules, the library and the
/// kernel, the dependencies, the compiler. `None` for an id without a module.
pub fn version(id: &str) -> Option<String> {
    let module = id.replace('-', "_");
    let mut parts = vec![hash_of(&module)?];
    // Its start is a result of Q-MAT.
    if module == "tight" {
        parts.push(hash_of("qmat").unwrap_or_default());
    }
    parts.push(hash_of("shared").unwrap_or_default());
    parts.extend([medial::SOURCE_HASH, medial::geometry::SOURCE_HASH, env!("BUILD")]);
    Some(parts.join(" "))
}

/// The hash of a module's sources, which the build script computes.
fn hash_of(module: &str) -> Option<&'static str> {
    let mut hashes = env!("SOURCE_HASHES").split(';');
    hashes.find_map(|pair| pair.strip_prefix(module)?.strip_prefix('='))
}

/// Seconds at the default levels on bear.off on two cores, from cheap to dear, measuring included. Only their order
/// and their ratios matter.
const SECONDS: [(&str, f64); 16] = [
    ("initial", 3.0),
    ("qmat", 0.5),
    ("sphere-mesh", 0.6),
    ("pmat", 1.0),
    ("sat-pairwise", 2.2),
    ("coverage-axis", 2.6),
    ("angle", 2.6),
    ("lambda", 2.6),
    ("dey-zhao", 2.7),
    ("aof", 3.5),
    ("vmas", 3.8),
    ("tam-heidrich", 4.9),
    ("hem", 5.2),
    ("sat", 9.0),
    ("cover", 18.0),
    ("tight", 26.0),
];

/// The cost of a method, to order and to weigh the methods of a comparison; `None` for one from elsewhere.
pub fn usual_seconds(id: &str) -> Option<f64> {
    SECONDS.iter().find(|&&(known, _)| known == id).map(|&(_, seconds)| seconds)
}

/// The method with an id, or `None`. [`initial`] simplifies nothing and is not among them.
pub fn find(id: &str) -> Option<Box<dyn MedialSimplifier>> {
    registry().into_iter().map(|entry| entry.method).find(|method| method.info().id == id)
}

/// The entries of `references.bib` with these keys, as BibTeX.
fn references(keys: &[&str]) -> String {
    let all = include_str!("references.bib").split("\n\n").map(str::trim_end);
    let found: Vec<&str> =
        all.filter(|entry| keys.iter().any(|key| entry.contains(&format!("{{{key},")))).collect();
    assert_eq!(found.len(), keys.len(), "no entry for one of {keys:?}");
    found.join("\n")
}

/// A built-in solid, for unit tests.
#[cfg(test)]
fn test_shape(id: &str, resolution: u32) -> medial::shape::Shape {
    test_solid(id, &medial_datasets::find(id).expect("in the catalogue").mesh(resolution))
}

/// A box around the origin with half sides `half`, for unit tests.
#[cfg(test)]
fn test_cuboid(half: medial::Vec3) -> medial::shape::Shape {
    let corner = |k: u32| {
        half * medial::Vec3::from([k & 1, k >> 1 & 1, k >> 2].map(|bit| 2.0 * f64::from(bit) - 1.0))
    };
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    test_solid("box", &medial::surface::TriMesh { vertices: (0..8).map(corner).collect(), faces })
}

#[cfg(test)]
fn test_solid(name: &str, mesh: &medial::surface::TriMesh) -> medial::shape::Shape {
    let report = medial::surface::validate(mesh).expect("a solid");
    medial::shape::Shape::new(name, mesh, report, Default::default()).expect("an extent")
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::{Registered, SECONDS, registry, usual_seconds, version};

    #[path = "../build.rs"]
    mod build;

    #[test]
    fn an_edit_of_one_method_changes_the_version_of_that_method_alone() {
        fn copy(from: &Path, to: &Path) {
            fs::create_dir_all(to).expect("a folder");
            for entry in fs::read_dir(from).expect("a folder") {
                let (path, to) =
                    entry.map(|e| (e.path(), to.join(e.file_name()))).expect("an entry");
                if path.is_dir() {
                    copy(&path, &to);
                } else {
                    fs::copy(&path, &to).expect("copied");
                }
            }
        }
        let root = tempfile::tempdir().expect("a folder");
        copy(Path::new(env!("CARGO_MANIFEST_DIR")), root.path());
        let before = build::hashes(root.path());
        let exported: Vec<String> =
            before.iter().map(|(module, hash)| format!("{module}={hash}")).collect();
        assert_eq!(exported.join(";"), env!("SOURCE_HASHES"));
        let edit = |file: &str| {
            let path = root.path().join(file);
            let mut bytes = fs::read(&path).expect("a source");
            bytes.push(b'\n');
            fs::write(&path, bytes).expect("written");
            build::hashes(root.path())
        };
        let qmat =
            ["qmat.rs", "qmat/mod.rs"].into_iter().find(|file| root.path().join(file).exists());
        let after = edit(qmat.expect("the module of Q-MAT"));
        for (module, hash) in &after {
            assert_eq!(before[module] != *hash, module == "qmat", "{module}");
        }
        assert_eq!(edit("lib.rs"), after, "how methods are presented changes no result");
        assert_ne!(edit("ranked.rs")["shared"], after["shared"]);
    }

    #[test]
    fn every_method_has_its_own_version() {
        let versions: Vec<_> =
            registry().into_iter().map(|r| r.version.expect("a version")).collect();
        for (k, version) in versions.iter().enumerate() {
            assert!(!versions[..k].contains(version));
        }
        let part = |id: &str, k: usize| {
            version(id).expect("a method").split(' ').nth(k).map(str::to_owned)
        };
        assert_eq!(part("tight", 1), part("qmat", 0), "the method that it starts from");
        assert_eq!(version("nothing"), None);
    }

    #[test]
    fn every_method_has_a_cost() {
        for Registered { method, .. } in registry() {
            assert!(usual_seconds(&method.info().id).is_some(), "{}", method.info().id);
        }
        assert_eq!(usual_seconds("theirs"), None);
        assert!(SECONDS[1..].is_sorted_by(|(_, a), (_, b)| a <= b), "after the start");
    }

    #[test]
    fn default_sweeps_go_from_fine_to_coarse_wherever_there_is_a_native_level() {
        for Registered { method, presentation, .. } in registry() {
            let (info, sweep) = (method.info(), presentation.sweep);
            // Native levels of these are error bounds and cost several runs each.
            let runs_sweep = info.id != "tight" && info.id != "cover";
            let Some(native) = info.native.as_ref().filter(|_| runs_sweep) else {
                assert!(sweep.is_empty(), "{}: a sweep that no comparison runs", info.id);
                continue;
            };
            assert!(sweep.len() >= 2, "{}: {sweep:?}", info.id);
            let is_coarser = |pair: &[f64]| match native.larger_is_coarser {
                true => pair[0] < pair[1],
                false => pair[0] > pair[1],
            };
            assert!(sweep.windows(2).all(is_coarser), "{}: {sweep:?}", info.id);
        }
    }
}

#[cfg(doctest)]
#[doc = include_str!("README.md")]
struct Readme;
