//! Runs the checks of `page_checks.txt` in a browser, from disk and without a network: no error, no request.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use medial::Vec3;
use medial::complex::{MedialMesh, Sphere};
use medial::surface::TriMesh;
use medial_reports::{View3d, picture_strips, write_report, write_site};
use medial_run::record::Record;
use serde_json::{Value, json};

use super::common::{SHAPES, comparison, header};

const BROWSER: &str = "chromium";
/// More rows than the document has at first.
const METHODS: [&str; 6] = ["qmat", "angle", "lambda", "sat", "hem", "pmat"];
const COUNTS: [usize; 4] = [1000, 500, 200, 100];
/// Limit of each wait.
const PATIENCE: Duration = Duration::from_secs(60);

/// A browser without a window, controlled through a pipe by its DevTools protocol.
struct Browser {
    child: Child,
    to: ChildStdin,
    from: Receiver<Value>,
    last: u64,
    session: Option<String>,
    /// Its events.
    events: Vec<Value>,
}

impl Browser {
    /// `None`, with a notice, where there is no browser.
    fn start(profile: &Path) -> Option<Self> {
        let found = Command::new(BROWSER).arg("--version").output();
        if !found.is_ok_and(|answer| answer.status.success()) {
            medial_test_support::skip("no chromium");
            return None;
        }
        // The protocol uses the descriptors 3 and 4.
        let redirected = "exec \"$@\" 3<&0 4>&1 </dev/null >/dev/null 2>/dev/null";
        let mut child = Command::new("sh")
            .args(["-c", redirected, "sh", BROWSER, "--headless", "--no-sandbox", "--disable-gpu"])
            // WebGL without a graphics card.
            .args(["--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
            .args(["--remote-debugging-pipe", "--no-first-run", "--disable-extensions"])
            .args(["--window-size=1400,1000", "--disable-background-networking"])
            // No way out: a proxy where nothing listens.
            .args(["--proxy-server=http://127.0.0.1:9", "--proxy-bypass-list=<-loopback>"])
            .arg(format!("--user-data-dir={}", profile.display()))
            .arg("about:blank")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let to = child.stdin.take().unwrap();
        let out = BufReader::new(child.stdout.take().unwrap());
        let (send, from) = channel();
        thread::spawn(move || {
            // A zero byte ends each message.
            for message in out.split(0).map_while(Result::ok) {
                if send.send(serde_json::from_slice(&message).unwrap()).is_err() {
                    return;
                }
            }
        });
        let events = Vec::new();
        let mut browser = Self { child, to, from, last: 0, session: None, events };
        browser.attach();
        Some(browser)
    }

    fn attach(&mut self) {
        let targets = self.call("Target.getTargets", json!({}));
        let targets = targets["targetInfos"].as_array().unwrap().clone();
        let page = targets.iter().find(|target| target["type"] == "page").unwrap();
        let id = &page["targetId"];
        let answer = self.call("Target.attachToTarget", json!({"targetId": id, "flatten": true}));
        self.session = answer["sessionId"].as_str().map(str::to_owned);
        for domain in ["Page", "Runtime", "Log", "Network"] {
            self.call(&format!("{domain}.enable"), json!({}));
        }
    }

    fn call(&mut self, method: &str, params: Value) -> Value {
        self.last += 1;
        let mut message = json!({"id": self.last, "method": method, "params": params});
        if let Some(session) = &self.session {
            message["sessionId"] = session.as_str().into();
        }
        let mut bytes = serde_json::to_vec(&message).unwrap();
        bytes.push(0);
        self.to.write_all(&bytes).unwrap();
        loop {
            let answer =
                self.from.recv_timeout(PATIENCE).unwrap_or_else(|e| panic!("{method}: {e}"));
            if answer["id"] == self.last {
                assert!(answer.get("error").is_none(), "{method}: {answer}");
                return answer["result"].clone();
            }
            self.events.push(answer);
        }
    }

    /// The value of an expression on the page.
    fn value(&mut self, expression: &str) -> Value {
        let params = json!({"expression": expression, "returnByValue": true});
        let answer = self.call("Runtime.evaluate", params);
        assert!(answer.get("exceptionDetails").is_none(), "{expression}: {answer}");
        answer["result"]["value"].clone()
    }

    /// Waits until a condition holds.
    fn until(&mut self, expression: &str) {
        let start = Instant::now();
        while self.value(expression) != true {
            assert!(start.elapsed() < PATIENCE, "never true: {expression}");
            thread::sleep(Duration::from_millis(20));
        }
    }

    fn open(&mut self, url: &str) {
        self.call("Page.navigate", json!({"url": url}));
        self.until(
            "location.protocol === 'file:' && 'ready' in (document.documentElement?.dataset ?? {})",
        );
        // Animated elements would move from under the mouse.
        self.value("document.documentElement.style.scrollBehavior = 'auto'");
    }

    /// Brings an element into sight and gives its centre.
    fn centre(&mut self, element: &str) -> [f64; 2] {
        let place = format!(
            "(() => {{ const element = {element}; element.scrollIntoView({{block: 'center'}}); \
             const box = element.getBoundingClientRect(); \
             return [box.x + box.width / 2, box.y + box.height / 2]; }})()"
        );
        let place = self.value(&place);
        [0, 1].map(|k: usize| place[k].as_f64().unwrap())
    }

    fn mouse(&mut self, kind: &str, [x, y]: [f64; 2], held: u32) {
        let button = if kind == "mouseMoved" && held == 0 { "none" } else { "left" };
        let params = json!({
            "type": kind, "x": x, "y": y, "button": button, "buttons": held, "clickCount": 1,
        });
        self.call("Input.dispatchMouseEvent", params);
    }

    fn key(&mut self, key: &str, code: u32) {
        let text = if key == "Enter" { "\r" } else { "" };
        for kind in ["keyDown", "keyUp"] {
            let params = json!({
                "type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code,
                "text": if kind == "keyDown" { text } else { "" },
            });
            self.call("Input.dispatchKeyEvent", params);
        }
    }

    /// Takes steps: each line is a word and its argument, as the head of the file defines.
    fn run(&mut self, steps: &str) {
        for (number, line) in steps.lines().enumerate() {
            let Some((word, what)) = line.split_once(' ').filter(|_| !line.starts_with('#')) else {
                continue;
            };
            match word {
                "do" => drop(self.value(&format!("{what}; 0"))),
                "is" => {
                    let (expression, expected) = what.rsplit_once(" == ").unwrap();
                    let expected: Value = serde_json::from_str(expected).unwrap();
                    assert_eq!(self.value(expression), expected, "line {}: {line}", number + 1);
                }
                "until" => self.until(what),
                "key" => {
                    let (key, code) = what.split_once(' ').unwrap();
                    self.key(key, code.parse().unwrap());
                }
                "over" | "click" | "drag" => {
                    let [x, y] = self.centre(what);
                    self.mouse("mouseMoved", [x, y], 0);
                    if word != "over" {
                        let by = if word == "drag" { 60.0 } else { 0.0 };
                        self.mouse("mousePressed", [x, y], 1);
                        self.mouse("mouseMoved", [x + by, y + by], 1);
                        self.mouse("mouseReleased", [x + by, y + by], 0);
                    }
                }
                _ => panic!("line {}: no such step: {line}", number + 1),
            }
        }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A tetrahedron, and a medial mesh that its reconstruction differs from.
fn write_views(folder: &Path, records: &[Record]) {
    let vertices = vec![Vec3::ZERO, 2.0 * Vec3::X, 2.0 * Vec3::Y, 2.0 * Vec3::Z];
    let faces = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let surface = TriMesh { vertices, faces };
    let ball = |x, y, r| Sphere::new(Vec3::new(x, y, 0.5), r);
    let spheres = vec![ball(0.3, 0.3, 0.3), ball(0.7, 0.3, 0.25), ball(0.7, 0.7, 0.2)];
    let axis = MedialMesh::from_simplices(spheres, vec![], vec![[0, 1, 2]]).unwrap();
    std::fs::create_dir(folder.join("views")).unwrap();
    for strip in picture_strips(records) {
        let results = strip.panels.iter().map(|(_, caption)| (caption.clone(), &axis)).collect();
        let script = View3d::new(&surface, results).unwrap().script(&strip.view);
        std::fs::write(folder.join(strip.view_file()), script).unwrap();
    }
}

#[test]
fn the_page_works_from_disk() {
    let folder = tempfile::tempdir().unwrap();
    let profile = tempfile::tempdir().unwrap();
    let Some(mut browser) = Browser::start(profile.path()) else { return };
    let records = comparison(&SHAPES, &METHODS, &COUNTS);
    write_views(folder.path(), &records);
    write_report(folder.path(), &records, &header(&METHODS)).unwrap();
    browser.open(&format!("file://{}/index.html", folder.path().display()));
    browser.run(include_str!("page_checks.txt"));

    let mut requests = 0;
    for event in &browser.events {
        let params = &event["params"];
        match event["method"].as_str().unwrap_or_default() {
            "Network.requestWillBeSent" => {
                let url = params["request"]["url"].as_str().unwrap();
                // Scripts made from the page's text are no requests.
                assert!(url.starts_with("file:") || url.starts_with("blob:"), "{url}");
                requests += usize::from(url.starts_with("file:"));
            }
            "Runtime.exceptionThrown" => panic!("{params}"),
            "Runtime.consoleAPICalled" => assert_ne!(params["type"], "error", "{params}"),
            "Log.entryAdded" => assert_ne!(params["entry"]["level"], "error", "{params}"),
            _ => {}
        }
    }
    assert_eq!(requests, 2, "the page and the view that it does not hold");
}

#[test]
fn links_that_a_site_draws_resolve() {
    let [store, site, profile] = [(); 3].map(|()| tempfile::tempdir().unwrap());
    let Some(mut browser) = Browser::start(profile.path()) else { return };
    let records = comparison(&SHAPES[..2], &METHODS[..3], &COUNTS);
    let header = header(&["qmat", "angle", "lambda", "not-run"]);
    write_site(site.path(), store.path(), &records, &header).unwrap();
    browser.open(&format!("file://{}/index.html", site.path().display()));
    browser.value("document.querySelectorAll('details').forEach((fold) => { fold.open = true; fold.fill?.(); }); 0");
    let links = browser
        .value("[...document.querySelectorAll('a[href]')].map((a) => a.getAttribute('href'))");
    let links: Vec<&str> = links.as_array().unwrap().iter().filter_map(Value::as_str).collect();
    let files = links.iter().filter_map(|link| link.strip_prefix("./"));
    let missing: Vec<&str> =
        files.clone().filter(|file| !site.path().join(file).exists()).collect();
    assert!(missing.is_empty() && files.count() > 10, "{missing:?} of {links:?}");
}
