//! An item: everything that decides a record, as data.
//!
//! One method with its parameters on one input, at some levels. An item can be written to a file and
//! run on another machine with the same results. Each of its levels has a key, by which a store finds
//! an earlier record.

use std::time::Duration;

use medial::simplifier::Params;
use serde::{Deserialize, Serialize};

use crate::hash::hex_digest;
use crate::input::Source;
use crate::level::Target;
use crate::scene::SceneSpec;

/// Id of the pseudo-method of external results.
pub const GIVEN: &str = "given";

/// One method on one input at some levels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Item {
    /// The input, and how results on it are measured.
    pub scene: SceneSpec,
    /// The method.
    pub method: MethodSpec,
    /// Levels, in the order in which they run.
    pub levels: Vec<Target>,
    /// Seed of the method's random choices.
    pub seed: u64,
    /// Number of timed repetitions of each level, at least 1.
    pub repeat: usize,
    /// Limits of time and memory.
    pub limits: Limits,
    /// The version of the method: records of other versions do not count.
    pub version: String,
    /// SHA-256 of the program that runs it, recorded only.
    pub binary: String,
}

/// A method, its parameters, and the name of this pair in tables.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MethodSpec {
    /// Id of the method.
    pub id: String,
    /// Name of the variant in tables, if it differs from the id.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Parameters; missing ones have the paper's values.
    pub params: Params,
    /// For a plug-in, the hash of its declaration and files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fingerprint: Option<String>,
}

/// Limits of time and memory of an item.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Wall-clock seconds for each of three stages: loading the input, all levels together, and their evaluation.
    pub seconds: f64,
    /// Bytes of memory of the worker and the programs that it started, together.
    pub bytes: u64,
    /// Seconds after which no further level of the item starts. `None` is not serialized, for workers of older builds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget: Option<f64>,
}

/// Most spheres of a result on disk at a native or published level.
const MOST_SMALL: usize = 1_000;

impl Item {
    /// Whether a result stays on disk as `.ma`: external ones, those at a count or a bound, and small ones. The others
    /// can be recomputed from their records.
    pub fn keeps(&self, level: Target, spheres: usize) -> bool {
        let is_requested = matches!(level, Target::Spheres(_) | Target::MaxError(_));
        is_requested || self.method.id == GIVEN || spheres <= MOST_SMALL
    }

    /// The key of one level: equal for equal work. It is independent of limits and of the number of
    /// repetitions, which do not change a result.
    pub fn key(&self, level: Target) -> String {
        self.keys_of(&[level]).remove(0)
    }

    /// The keys of all levels, in their order.
    pub fn keys(&self) -> Vec<String> {
        self.keys_of(&self.levels)
    }

    fn keys_of(&self, levels: &[Target]) -> Vec<String> {
        // Parameters in the order of their names, however they were given.
        let params: std::collections::BTreeMap<_, _> = self.method.params.0.iter().collect();
        let source = match &self.scene.source {
            // The same file in another place is the same input.
            Source::File(_) | Source::Cached(_) => None,
            built_in @ Source::BuiltIn { .. } => Some(built_in),
        };
        // Field by field: a new field must be added here, or left out, on purpose.
        let SceneSpec { mesh, hash, noise, settings, .. } = &self.scene;
        let MethodSpec { id, name, fingerprint, .. } = &self.method;
        let scene = (mesh, source, hash, noise, settings);
        let rest = (scene, (id, name, params, fingerprint), self.seed, &self.version);
        // Once for all levels: items of long sweeps have dozens.
        let common = serde_json::to_string(&rest).expect("plain data");
        (levels.iter())
            .map(|level| {
                let level = serde_json::to_string(level).expect("plain data");
                hex_digest(format!("{common}\n{level}").as_bytes())
            })
            .collect()
    }
}

impl MethodSpec {
    /// The name for tables and messages: the name of the variant, or the id.
    pub fn label(&self) -> &str {
        self.name.as_deref().unwrap_or(&self.id)
    }
}

impl Limits {
    /// The limit of time.
    pub fn time(&self) -> Duration {
        Duration::try_from_secs_f64(self.seconds).unwrap_or(Duration::MAX)
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use medial::complex::DualTriangulation;
    use medial::surface::Sampling;

    use super::*;
    use crate::scene::Noise;
    use crate::settings::Settings;

    fn item() -> Item {
        Item {
            scene: SceneSpec {
                mesh: "bear".into(),
                source: Source::File(PathBuf::from("bear.off")),
                hash: Some("12ab".into()),
                noise: None,
                settings: Settings {
                    sampling: Sampling::default(),
                    dual: DualTriangulation::Fan,
                    samples: 100,
                    volume_depth: 5,
                    seed: 0,
                    certify: None,
                    spheres_alone: false,
                    threads: 2,
                },
            },
            method: MethodSpec {
                id: "qmat".into(),
                name: None,
                params: Params::none(),
                fingerprint: None,
            },
            levels: vec![Target::Spheres(100), Target::Native(0.1), Target::Published],
            seed: 0,
            repeat: 1,
            limits: Limits { seconds: 300.0, bytes: 1 << 30, budget: None },
            version: "34cd".into(),
            binary: "56ef".into(),
        }
    }

    #[test]
    fn keys_depend_exactly_on_the_fields_that_decide_a_record() {
        let key = |change: fn(&mut Item)| {
            let mut changed = item();
            change(&mut changed);
            changed.key(Target::Spheres(100))
        };
        let plain = key(|_| ());
        let same: [fn(&mut Item); 5] = [
            // A rebuild that changed no method: the page, a verb.
            |i| i.binary = "56f0".into(),
            |i| i.limits.seconds = 1.0,
            |i| i.repeat = 5,
            |i| i.levels.clear(),
            |i| i.scene.source = Source::File("elsewhere/bear.off".into()),
        ];
        for change in same {
            assert_eq!(key(change), plain);
        }
        let other: [fn(&mut Item); 10] = [
            |i| i.scene.mesh = "bear-2".into(),
            |i| i.scene.hash = Some("12ac".into()),
            |i| i.scene.noise = Some(Noise { eta: 0.01, seed: 1 }),
            |i| i.scene.settings.dual = DualTriangulation::Delaunay,
            |i| i.scene.settings.samples += 1,
            |i| i.method.id = "hem".into(),
            |i| i.method.params.set("k", "0"),
            |i| i.seed = 1,
            |i| i.scene.settings.threads = 1,
            |i| i.version = "34ce".into(),
        ];
        let mut keys: Vec<String> = other.into_iter().map(key).collect();
        keys.push(plain);
        keys.extend(item().keys().into_iter().skip(1));
        keys.sort_unstable();
        keys.dedup();
        assert_eq!(keys.len(), 13);
    }

    #[test]
    fn the_order_of_parameters_is_irrelevant() {
        let with = |keys: [&str; 2]| {
            let mut item = item();
            keys.iter().for_each(|key| item.method.params.set(key, "1"));
            item.keys()
        };
        assert_eq!(with(["a", "b"]), with(["b", "a"]));
    }

    #[test]
    fn items_and_their_numbers_survive_json() {
        for number in (1..10_000).map(|k| f64::from(k).sqrt() * 1e-3) {
            let item = Item { levels: vec![Target::Native(number)], ..item() };
            let text = serde_json::to_string(&item).unwrap();
            assert_eq!(serde_json::from_str::<Item>(&text).unwrap(), item, "{text}");
        }
        let unknown = serde_json::to_string(&item()).unwrap().replacen("\"seed\"", "\"sead\"", 1);
        assert!(serde_json::from_str::<Item>(&unknown).unwrap_err().to_string().contains("sead"));
    }
}
