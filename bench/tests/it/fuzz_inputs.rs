//! Damaged files of every format through the verbs that read them: no panic, no endless run, no
//! gigabytes.
//!
//! Ignored, since it runs as long as it is told to:
//!
//! ```sh
//! MEDIAL_FUZZ_SEED=7 MEDIAL_FUZZ_SECONDS=600 cargo test -p medial-bench --test fuzz_inputs -- --ignored
//! ```
//!
//! `MEDIAL_FUZZ_KIND=ply` keeps to one kind of file, by its extension. Inputs that failed are left in
//! the system's temporary folder, under the names that are printed.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Longest run on a file of this size, and its address space: a gigabyte, and what threads reserve.
const LONGEST: Duration = Duration::from_secs(10);
const ADDRESS_SPACE_KB: u32 = 1_600_000;

/// Numbers that have broken readers and geometry before.
const HOSTILE: [&str; 18] = [
    "0",
    "-0",
    "-1",
    "1",
    "3",
    "255",
    "2147483648",
    "4294967295",
    "4294967296",
    "1e-320",
    "1e-155",
    "1e-100",
    "1e57",
    "1e155",
    "1e308",
    "inf",
    "nan",
    "0.1e",
];

/// A small generator of its own: the same seed is the same damage on every machine.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) % bound.max(1) as u64) as usize
    }
}

/// A file to damage, and the command lines that read it; `{}` stands for the damaged file.
struct Target {
    extension: &'static str,
    content: Vec<u8>,
    commands: Vec<Vec<String>>,
}

fn medial(arguments: &[String]) -> Command {
    let mut command = Command::new("sh");
    let limited = format!("ulimit -v {ADDRESS_SPACE_KB}; exec \"$0\" \"$@\"");
    command.args(["-c", &limited, env!("CARGO_BIN_EXE_medial")]).args(arguments);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

fn words(line: &str) -> Vec<String> {
    line.split(' ').map(str::to_owned).collect()
}

fn make(line: &str, file: &Path) -> Vec<u8> {
    let arguments = words(&line.replace("{}", file.to_str().expect("UTF-8")));
    assert!(medial(&arguments).status().expect("the command starts").success(), "{line}");
    fs::read(file).expect("a file")
}

fn targets(folder: &Path) -> Vec<Target> {
    let at = |name: &str| folder.join(name);
    let axis = at("axis.ma");
    let ma = make("axis builtin:box:8 -o {}", &axis);
    let reading = |lines: &[&str]| lines.iter().map(|line| words(line)).collect::<Vec<_>>();
    let out = |name: &str| at(name).to_str().expect("UTF-8").to_owned();
    let surface = [
        "info {}".to_owned(),
        "simplify {} -m qmat --spheres 20 -q".to_owned(),
        format!("evaluate {{}} {} --samples 200", axis.display()),
        format!("repair {{}} -o {} --fill-holes --separate", out("mended.off")),
    ];
    let surface: Vec<&str> = surface.iter().map(String::as_str).collect();
    let surface = reading(&surface);
    let mut targets = Vec::new();
    for extension in ["off", "obj", "ply"] {
        let line = "datasets make sphere --resolution 8 -o {}";
        let content = make(line, &at(&format!("sphere.{extension}")));
        targets.push(Target { extension, content, commands: surface.clone() });
    }
    let stl = ascii_stl(&String::from_utf8_lossy(&targets[0].content));
    targets.push(Target { extension: "stl", content: stl.into_bytes(), commands: surface });
    let medial_mesh = [
        "evaluate builtin:box:8 {} --samples 200".to_owned(),
        format!("reconstruct {{}} -o {} --tolerance 0.05", out("union.ply")),
        format!("convert {{}} {}", out("converted.ply")),
        "simplify builtin:box:8 -m qmat --spheres 9 -q --initial {}".to_owned(),
    ];
    let medial_mesh: Vec<&str> = medial_mesh.iter().map(String::as_str).collect();
    let medial_mesh = reading(&medial_mesh);
    targets.push(Target { extension: "ma", content: ma, commands: medial_mesh });
    targets
}

/// The triangles of an OFF file as ASCII STL.
fn ascii_stl(off: &str) -> String {
    let rows: Vec<Vec<&str>> = off.lines().map(|line| line.split(' ').collect()).collect();
    let vertices: usize = rows[1][0].parse().expect("a count");
    let mut text = "solid s\n".to_owned();
    for face in &rows[2 + vertices..] {
        text += "facet normal 0 0 0\nouter loop\n";
        for corner in &face[1..4] {
            let corner: usize = corner.parse().expect("an index");
            text += &format!("vertex {}\n", rows[2 + corner].join(" "));
        }
        text += "endloop\nendfacet\n";
    }
    text + "endsolid s\n"
}

/// One kind of damage.
fn damage(content: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = content.to_vec();
    for _ in 0..1 + random.below(3) {
        match random.below(6) {
            0 => {
                let place = random.below(bytes.len());
                if let Some(byte) = bytes.get_mut(place) {
                    *byte ^= 1 << random.below(8);
                }
            }
            1 => {
                // A double, as binary files have them.
                let place = random.below(bytes.len().saturating_sub(8)) & !7;
                let value = [0.0, 1e-300, 1e57, 1e155, f64::NAN, f64::INFINITY][random.below(6)];
                if bytes.len() >= place + 8 && std::str::from_utf8(&bytes).is_err() {
                    bytes[place..place + 8].copy_from_slice(&value.to_le_bytes());
                }
            }
            2 => bytes = lines_damaged(&bytes, random),
            3 | 4 => bytes = number_replaced(&bytes, random),
            _ => bytes = axis_scaled(&bytes, random),
        }
    }
    bytes
}

fn lines_damaged(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut lines: Vec<&[u8]> = bytes.split(|&byte| byte == b'\n').collect();
    let (from, to) = (random.below(lines.len()), random.below(lines.len()));
    match random.below(4) {
        0 => drop(lines.remove(from)),
        1 => lines.insert(to, lines[from]),
        2 => lines.swap(from, to),
        _ => lines.truncate(from),
    }
    lines.join(&b'\n')
}

fn number_replaced(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let Ok(text) = std::str::from_utf8(bytes) else { return bytes.to_vec() };
    let mut words: Vec<&str> = text.split_inclusive([' ', '\n']).collect();
    let place = random.below(words.len());
    let end = if words.get(place).is_some_and(|word| word.ends_with('\n')) { "\n" } else { " " };
    let hostile = format!("{}{end}", HOSTILE[random.below(HOSTILE.len())]);
    if let Some(word) = words.get_mut(place) {
        *word = &hostile;
    }
    words.concat().into_bytes()
}

/// Geometric damage: a column of the long lines scaled, or rounded to a coarse lattice.
fn axis_scaled(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let Ok(text) = std::str::from_utf8(bytes) else { return bytes.to_vec() };
    let column = random.below(4);
    let factor = [0.0, 1e-300, 1e-100, 1e-6, 1e6, 1e12, 1e50, 1e150][random.below(8)];
    let is_rounded = random.below(3) == 0;
    let changed = |line: &str| {
        let mut words: Vec<String> = line.split(' ').map(str::to_owned).collect();
        if let Some(word) = words.get_mut(column).filter(|word| word.contains('.'))
            && let Ok(x) = word.parse::<f64>()
        {
            *word = if is_rounded {
                format!("{:?}", (4.0 * x).round() / 4.0)
            } else {
                format!("{:?}", x * factor)
            };
        }
        words.join(" ")
    };
    text.split('\n').map(changed).collect::<Vec<_>>().join("\n").into_bytes()
}

/// What is wrong with a run, if anything.
fn verdict(mut child: Child) -> Option<String> {
    let start = Instant::now();
    loop {
        match child.try_wait().expect("its state") {
            Some(status) if matches!(status.code(), Some(0..=5)) => return None,
            Some(status) => return Some(format!("ended with {status}")),
            None if start.elapsed() > LONGEST => {
                child.kill().expect("killed");
                child.wait().expect("ended");
                return Some(format!("ran longer than {LONGEST:?}"));
            }
            None => std::thread::sleep(Duration::from_millis(2)),
        }
    }
}

#[test]
#[ignore = "runs as long as MEDIAL_FUZZ_SECONDS says"]
fn damaged_files_neither_panic_nor_run_away() {
    let number = |name: &str, default: u64| {
        std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
    };
    let seed = number("MEDIAL_FUZZ_SEED", 1);
    let end = Instant::now() + Duration::from_secs(number("MEDIAL_FUZZ_SECONDS", 60));
    let dir = tempfile::tempdir().expect("a folder");
    let kind = std::env::var("MEDIAL_FUZZ_KIND").ok();
    let mut targets = targets(dir.path());
    targets.retain(|target| kind.as_ref().is_none_or(|kind| kind == target.extension));
    assert!(!targets.is_empty(), "no kind of file is called {kind:?}");
    let mut random = Random(seed);
    let (mut runs, mut failures) = (0, Vec::new());
    while Instant::now() < end {
        let target = &targets[random.below(targets.len())];
        let content = damage(&target.content, &mut random);
        let file: PathBuf = dir.path().join(format!("damaged.{}", target.extension));
        fs::write(&file, &content).expect("written");
        let arguments = &target.commands[random.below(target.commands.len())];
        let arguments: Vec<String> = arguments
            .iter()
            .map(|word| word.replace("{}", file.to_str().expect("UTF-8")))
            .collect();
        runs += 1;
        if let Some(why) = verdict(medial(&arguments).spawn().expect("the command starts")) {
            let name = format!("medial-fuzz-{seed}-{runs}.{}", target.extension);
            let kept = std::env::temp_dir().join(name);
            fs::write(&kept, &content).expect("written");
            failures.push(format!("{}: {why}: {}", kept.display(), arguments.join(" ")));
        }
    }
    assert!(failures.is_empty(), "{} of {runs} runs:\n{}", failures.len(), failures.join("\n"));
    assert!(runs > 0);
}
