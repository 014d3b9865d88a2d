//! What an item will need: from the records of an earlier run, or all that its limits allow.
//!
//! Records of the same method count: those of the same mesh if there are any, otherwise those of the meshes of nearest
//! size, where a larger mesh takes more by [`GROWTH`]. The size of a mesh is the number of spheres of its initial medial
//! mesh. Too small an estimate costs a second submission, which asks for all that is allowed.

use std::collections::BTreeMap;
use std::path::Path;

use medial_reports::Target;
use medial_reports::{Record, Status, read_records};

use crate::exit::Failure;
use crate::run::{Input, Item, RESULTS, SceneSpec};

/// Time and memory grow with at most this power of the size, for the methods that we have.
const GROWTH: f64 = 1.5;
/// Spheres of an initial medial mesh for each vertex, about: a Delaunay triangulation of surface points has six to seven
/// cells a point, half of them inside.
const SPHERES_PER_VERTEX: f64 = 3.5;
/// What is asked for is so many times what was seen: other nodes, other neighbours on them.
const TIME_MARGIN: f64 = 3.0;
/// Likewise for memory, since records tell the live bytes of the method alone.
const MEMORY_MARGIN: f64 = 2.0;
/// Seconds to start a process and to read and prepare the mesh.
const START: f64 = 20.0;
/// Bytes of the program itself, its judge and its buffers.
const PROGRAM: f64 = 512e6;
/// Levels that a search for an error bound tries at most.
const SEARCHED: f64 = 25.0;

/// What an item needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Need {
    /// Its number.
    pub number: usize,
    /// Threads.
    pub threads: usize,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// Bytes of memory; infinite where there is no limit.
    pub bytes: f64,
}

/// Records of an earlier run, by method and mesh.
#[derive(Debug, Default)]
pub struct Earlier {
    seen: BTreeMap<String, Vec<Seen>>,
    /// Sizes of meshes by hash and by name.
    sizes: BTreeMap<String, f64>,
    /// Sizes of meshes that the earlier run did not have.
    others: Vec<(SceneSpec, Option<f64>)>,
}

/// What one record tells.
#[derive(Clone, Debug)]
struct Seen {
    mesh: String,
    hash: Option<String>,
    size: Option<f64>,
    /// Seconds of the level, measured; infinite where a limit ended it.
    seconds: f64,
    bytes: f64,
}

impl Need {
    /// All that the limits of an item allow. They hold for the reading, for the method and for the measuring, each, and
    /// for each search again.
    pub fn at_most(number: usize, item: &Item) -> Self {
        let searches = item.levels.iter().filter(|level| matches!(level, Target::MaxError(_)));
        let stages = 3 * item.repeat + searches.count();
        // A limit beyond every machine is none.
        let bytes = match item.limits.bytes {
            u64::MAX => f64::INFINITY,
            bytes => bytes as f64 + PROGRAM,
        };
        let seconds = START + item.limits.seconds * stages as f64;
        Self { number, threads: item.threads, seconds, bytes }
    }
}

impl Earlier {
    /// Reads the records of a store.
    ///
    /// # Errors
    /// When they cannot be read.
    pub fn read(store: &Path) -> Result<Self, Failure> {
        let journaled = read_records(&store.join(RESULTS)).map_err(Failure::input)?;
        let mut earlier = Self::default();
        for record in &journaled.records {
            let seen = Seen::of(record);
            if let Some(size) = seen.size {
                earlier.sizes.insert(seen.mesh.clone(), size);
                earlier.sizes.extend(seen.hash.iter().map(|hash| (hash.clone(), size)));
            }
            earlier.seen.entry(record.simplify.method.clone()).or_default().push(seen);
        }
        Ok(earlier)
    }

    /// What an item of a planned folder will need.
    pub fn need(&mut self, number: usize, item: &Item, dir: &Path) -> Need {
        let most = Need::at_most(number, item);
        let Some((seconds, bytes)) = self.a_level(item, dir) else { return most };
        let levels = item.levels.iter().map(|level| match level {
            Target::MaxError(_) => SEARCHED,
            _ => 1.0,
        });
        let runs = levels.sum::<f64>() * item.repeat as f64;
        Need {
            seconds: (START + TIME_MARGIN * runs * seconds).min(most.seconds),
            bytes: (PROGRAM + MEMORY_MARGIN * bytes).min(most.bytes),
            ..most
        }
    }

    /// Seconds and bytes of a level, the most that was seen; `None` where nothing tells.
    fn a_level(&mut self, item: &Item, dir: &Path) -> Option<(f64, f64)> {
        let scene = &item.scene;
        let same = |seen: &&Seen| match &scene.hash {
            Some(hash) => seen.hash.as_ref() == Some(hash),
            None => seen.mesh == scene.mesh,
        };
        let all = self.seen.get(&item.method.id)?;
        let on_it: Vec<&Seen> = all.iter().filter(same).collect();
        if !on_it.is_empty() {
            return Some(most(on_it.into_iter().map(|seen| (seen, 1.0))));
        }
        let size = self.size(scene, dir)?;
        let all = self.seen.get(&item.method.id)?;
        let sized = all.iter().filter_map(|seen| Some((seen, (size / seen.size?).ln())));
        let sized: Vec<(&Seen, f64)> = sized.collect();
        let nearest = sized.iter().map(|(_, distance)| distance.abs()).reduce(f64::min)?;
        // Meshes of about the same size differ more than their sizes do.
        let near = |distance: f64| distance.abs() <= nearest + std::f64::consts::LN_2;
        let near = sized.into_iter().filter(|&(_, distance)| near(distance));
        Some(most(near.map(|(seen, distance)| (seen, (GROWTH * distance.max(0.0)).exp()))))
    }

    /// The size of a mesh: as it was recorded, or else from its vertices.
    fn size(&mut self, scene: &SceneSpec, dir: &Path) -> Option<f64> {
        let key = scene.hash.as_ref().unwrap_or(&scene.mesh);
        if let Some(&size) = self.sizes.get(key) {
            return Some(size);
        }
        if let Some((_, size)) = self.others.iter().find(|(other, _)| other == scene) {
            return *size;
        }
        let source = match scene.source.path() {
            Some(path) => scene.source.moved(dir.join(path)),
            None => scene.source.clone(),
        };
        let vertices = Input::load(&source).ok().map(|input| input.mesh.vertices.len());
        let size = vertices.map(|vertices| SPHERES_PER_VERTEX * vertices as f64);
        self.others.push((scene.clone(), size));
        size
    }
}

impl Seen {
    fn of(record: &Record) -> Self {
        let ended = matches!(record.status, Status::TimedOut | Status::OutOfMemory);
        let simplify = record.simplify.seconds.map_or(0.0, |seconds| seconds.total);
        let seconds = simplify + record.evaluate_seconds.unwrap_or(0.0);
        Self {
            mesh: record.mesh.clone(),
            hash: record.mesh_hash.clone(),
            size: record.initial.map(|initial| initial.spheres.max(1) as f64),
            seconds: if ended { f64::INFINITY } else { seconds },
            bytes: match record.status {
                Status::OutOfMemory => f64::INFINITY,
                _ => record.simplify.peak_bytes.unwrap_or(0) as f64,
            },
        }
    }
}

/// The most seconds and bytes of records, each times a factor.
fn most<'s>(seen: impl Iterator<Item = (&'s Seen, f64)>) -> (f64, f64) {
    seen.fold((0.0, 0.0), |(seconds, bytes), (seen, factor)| {
        (f64::max(seconds, seen.seconds * factor), f64::max(bytes, seen.bytes * factor))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn item(mesh: &str, levels: serde_json::Value) -> Item {
        let item = serde_json::json!({
            "scene": {
                "mesh": mesh, "source": { "file": "nowhere.off" }, "hash": mesh, "sampling": "vertices", "dual": "fan",
                "measure": { "samples": 100, "volume_depth": 5, "seed": 0 },
            },
            "method": { "id": "qmat", "params": {} },
            "levels": levels, "seed": 0, "repeat": 1, "threads": 1,
            "limits": { "seconds": 300.0, "bytes": 8_000_000_000_u64 }, "binary": "",
        });
        serde_json::from_value(item).unwrap()
    }

    fn seen(mesh: &str, size: f64, seconds: f64) -> Seen {
        let (mesh, size) = (mesh.to_owned(), Some(size));
        Seen { hash: Some(mesh.clone()), mesh, size, seconds, bytes: 1e9 }
    }

    fn earlier() -> Earlier {
        let seen = vec![seen("small", 1000.0, 1.0), seen("large", 8000.0, 10.0)];
        let sizes = [("small", 1000.0), ("large", 8000.0), ("huge", 32_000.0)];
        Earlier {
            seen: [("qmat".to_owned(), seen)].into(),
            sizes: sizes.map(|(mesh, size)| (mesh.to_owned(), size)).into(),
            others: vec![],
        }
    }

    #[test]
    fn the_same_mesh_counts_and_else_one_of_nearest_size() {
        let two = || serde_json::json!([{ "spheres": 50 }, { "spheres": 20 }]);
        let seconds = |mesh: &str| earlier().need(0, &item(mesh, two()), Path::new(".")).seconds;
        assert_eq!(seconds("small"), START + TIME_MARGIN * 2.0);
        assert_eq!(seconds("large"), START + TIME_MARGIN * 20.0);
        // Four times as large: eight times as long, which the limits allow.
        assert!((seconds("huge") - (START + TIME_MARGIN * 160.0)).abs() < 1e-6);
        let need = earlier().need(0, &item("small", two()), Path::new("."));
        assert_eq!(need.bytes, PROGRAM + MEMORY_MARGIN * 1e9);
    }

    #[test]
    fn what_is_not_known_or_was_ended_gets_all_that_is_allowed() {
        let one = serde_json::json!([{ "spheres": 50 }, { "max_error": 0.01 }]);
        let unknown = item("unknown", one.clone());
        let most = Need::at_most(0, &unknown);
        assert_eq!((most.seconds, most.bytes), (START + 4.0 * 300.0, 8e9 + PROGRAM));
        assert_eq!(earlier().need(0, &unknown, Path::new(".")), most);
        assert_eq!(Earlier::default().need(0, &unknown, Path::new(".")), most);
        let mut ended = earlier();
        ended.seen.get_mut("qmat").unwrap().push(seen("small", 1000.0, f64::INFINITY));
        let need = ended.need(0, &item("small", one), Path::new("."));
        assert_eq!(need.seconds, most.seconds);
    }
}
