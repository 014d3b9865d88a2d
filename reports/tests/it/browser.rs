//! The page in a browser, from disk and without a network: no error, no request, and its script
//! answers.

use std::io::{Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use super::common::{SHAPES, comparison, header};
use medial::Vec3;
use medial::complex::{MedialMesh, Sphere};
use medial::surface::TriMesh;
use medial_reports::{Record, View3d, picture_strips, write_report};
use serde_json::{Value, json};

const BROWSER: &str = "chromium";
/// More rows than stand in the document at first.
const METHODS: [&str; 6] = ["qmat", "angle", "lambda", "sat", "hem", "pmat"];
const COUNTS: [usize; 4] = [1000, 500, 200, 100];
/// What takes longer has failed.
const PATIENCE: Duration = Duration::from_secs(60);

/// A browser without a window, told what to do through a pipe by its DevTools protocol.
struct Browser {
    child: Child,
    to: ChildStdin,
    from: Receiver<Value>,
    last: u64,
    session: Option<String>,
    /// What it said without being asked.
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
        // The protocol speaks on the descriptors 3 and 4.
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
        let mut out = child.stdout.take().unwrap();
        let (send, from) = channel();
        thread::spawn(move || {
            let mut pending = Vec::new();
            let mut piece = [0; 1 << 16];
            while let Ok(length @ 1..) = out.read(&mut piece) {
                pending.extend_from_slice(&piece[..length]);
                while let Some(end) = pending.iter().position(|&byte| byte == 0) {
                    let message: Vec<u8> = pending.drain(..=end).collect();
                    let message = serde_json::from_slice(&message[..end]).unwrap();
                    if send.send(message).is_err() {
                        return;
                    }
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

    fn text(&mut self, expression: &str) -> String {
        let value = self.value(expression);
        value.as_str().unwrap_or_else(|| panic!("{expression}: {value}")).to_owned()
    }

    /// Waits for what must become true.
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
        // What moves on its own moves from under the mouse.
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

    fn mouse(&mut self, kind: &str, [x, y]: [f64; 2]) {
        let button = if kind == "mouseMoved" { "none" } else { "left" };
        let params = json!({"type": kind, "x": x, "y": y, "button": button, "clickCount": 1});
        self.call("Input.dispatchMouseEvent", params);
    }

    fn drag(&mut self, from: [f64; 2], to: [f64; 2]) {
        self.mouse("mouseMoved", from);
        self.mouse("mousePressed", from);
        let params =
            json!({"type": "mouseMoved", "x": to[0], "y": to[1], "button": "left", "buttons": 1});
        self.call("Input.dispatchMouseEvent", params);
        self.mouse("mouseReleased", to);
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
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Chooses in a field of the filters as a user does.
fn choose(browser: &mut Browser, field: &str, value: &str) {
    browser.value(&format!(
        "{{ const field = document.querySelector('.filters').elements['{field}']; \
         field.value = '{value}'; field.dispatchEvent(new Event('input', {{bubbles: true}})); }}"
    ));
}

const SHOWN: &str = "document.querySelector('.filters output').textContent";
const ROWS: &str = "[...document.querySelectorAll('.sortable > tbody > tr[data-mesh]')]";

fn check_filters(browser: &mut Browser) {
    let all = SHAPES.len() * METHODS.len() * COUNTS.len();
    assert_eq!(browser.text(SHOWN), format!("{all} of {all} rows"));
    choose(browser, "method", "qmat");
    let of_method = SHAPES.len() * COUNTS.len();
    assert_eq!(browser.text(SHOWN), format!("{of_method} of {all} rows"));
    assert_eq!(browser.value(&format!("{ROWS}.every(row => row.dataset.method === 'qmat')")), true);
    choose(browser, "text", "bear 1,000");
    assert_eq!(browser.text(SHOWN), format!("1 of {all} rows"));
    choose(browser, "text", "");
    browser.until("location.hash === '#results?method=qmat'");

    browser.value("document.querySelector('th[data-key=hausdorff] button').click()");
    assert_eq!(
        browser.value("document.querySelector('th[data-key=hausdorff]').ariaSort"),
        "ascending"
    );
    let column = "[...document.querySelectorAll('.sortable > thead th')].findIndex(h => h.dataset.key === 'hausdorff')";
    let ascending = format!(
        "(() => {{ const column = {column}; \
         const values = {ROWS}.map(row => parseFloat(row.children[column].dataset.v)); \
         return values.length === {of_method} && values.every((v, k) => !k || v >= values[k - 1]); }})()"
    );
    assert_eq!(browser.value(&ascending), true);
    browser.until("location.hash === '#results?method=qmat&sort=hausdorff'");
}

/// The address brings back what was chosen.
fn check_address(browser: &mut Browser) {
    browser.value("location.hash = '#results?asked=100&sort=-spikes&columns=spikes+edges'");
    let all = SHAPES.len() * METHODS.len() * COUNTS.len();
    browser.until(&format!("{SHOWN} === '{} of {all} rows'", SHAPES.len() * METHODS.len()));
    assert_eq!(
        browser.value("document.querySelector('th[data-key=spikes]').ariaSort"),
        "descending"
    );
    let is_shown =
        |key: &str| format!("document.querySelector('th[data-key={key}]').offsetWidth > 0");
    for (key, shown) in [("mesh", true), ("edges", true), ("spikes", true), ("hausdorff", false)] {
        assert_eq!(browser.value(&is_shown(key)), shown, "{key}");
    }
    browser.value("document.querySelector('.filters').reset()");
    browser.until(&format!("{SHOWN} === '{all} of {all} rows'"));
    browser.value("location.hash = '#mesh-ant'");
    browser.until("document.getElementById('mesh-ant').open");
    browser.value("document.getElementById('mesh-ant').open = false");
}

/// The section of a mesh is made when it is opened, with plots that answer.
fn check_meshes(browser: &mut Browser) {
    let last = format!("document.querySelectorAll('details.mesh')[{}]", SHAPES.len() - 1);
    assert_eq!(browser.value(&format!("{last}.querySelector('figure') === null")), true);
    browser.value(&format!("{last}.open = true"));
    browser.until(&format!("{last}.querySelector('svg.chart[tabindex]') !== null"));
    assert_eq!(browser.value(&format!("{last}.querySelectorAll('figure.plot').length > 1")), true);
    let link = browser.text(&format!("{last}.querySelector('a').getAttribute('href')"));
    assert_eq!(link, "#results?mesh=box");
    browser.value(&format!("{last}.open = false"));
}

fn check_details(browser: &mut Browser) {
    browser.value("document.querySelector('button.more').focus()");
    browser.key("Enter", 13);
    browser.until("document.querySelector('tr.detail') !== null");
    let detail = browser.text("document.querySelector('tr.detail').textContent");
    assert!(detail.contains("medial simplify bear -m qmat --spheres 1000 --seed 1"), "{detail}");
    assert!(detail.contains("rejected by link condition"), "{detail}");
    browser.key("Enter", 13);
    browser.until("document.querySelector('tr.detail') === null");
    // The rest of the rows comes with scrolling.
    browser.value("document.querySelector('.scroll.tall').scrollTop = 1e9");
    let all = SHAPES.len() * METHODS.len() * COUNTS.len();
    browser.until(&format!("{ROWS}.length === {all}"));
}

/// Head and first columns stay in sight, above the rows that scroll beneath them.
fn check_sticky(browser: &mut Browser) {
    for input in ["edges", "faces", "epsilon", "spheres_only", "below_30"] {
        browser.value(&format!("document.querySelector('input[value={input}]').click()"));
    }
    browser.centre("document.querySelector('.scroll.tall')");
    browser.value(
        "{ const box = document.querySelector('.scroll.tall'); box.scrollLeft = 200; \
         box.scrollTop = 300; }",
    );
    assert_eq!(browser.value("document.querySelector('.scroll.tall').scrollLeft > 0"), true);
    for column in ["mesh", "asked", "method"] {
        let in_front = format!(
            "(() => {{ const head = document.querySelector('th[data-key={column}]'); \
             const box = head.getBoundingClientRect(); \
             return [0.1, 0.9].every(part => head.contains(document.elementFromPoint(\
             box.x + box.width / 2, box.y + part * box.height))); }})()"
        );
        assert_eq!(browser.value(&in_front), true, "{column}");
    }
    browser.value("document.querySelector('.filters').reset()");
}

/// The chart is drawn anew for each view: always the one that is in the document now.
const CHART: &str = "document.querySelector('figure.plot svg.chart')";
const SPOKEN: &str = "document.querySelector('figure.plot output').textContent";
const WHOLE: &str = "document.querySelector('figure.plot .whole').hidden";
const LEGEND: &str = "document.querySelector('figure.plot .legend button')";

fn check_plots(browser: &mut Browser) {
    let tips = format!(
        "[...{CHART}.querySelectorAll('g[aria-label=tip]')].map(g => g.textContent).join('')"
    );
    assert_eq!(browser.text(&tips), "");
    let mark = browser.centre(&format!("{CHART}.querySelector('g[aria-label=dot] > *')"));
    // The first movement brings the mouse into the plot.
    browser.mouse("mouseMoved", [mark[0] + 40.0, mark[1] + 40.0]);
    browser.mouse("mouseMoved", mark);
    browser.until(&format!("{tips}.includes('qmat') && {tips}.includes('n = 13 meshes')"));

    browser.value(&format!("{CHART}.focus()"));
    browser.key("ArrowDown", 40);
    let first = browser.text(SPOKEN);
    browser.key("ArrowDown", 40);
    let next = browser.text(SPOKEN);
    assert!(first.contains("qmat") && !next.is_empty() && next != first, "{first} {next}");
    browser.key("ArrowRight", 39);
    assert_ne!(browser.text(SPOKEN), next);
    browser.key("Escape", 27);
    assert_eq!(browser.text(SPOKEN), "");

    browser.value(&format!("{LEGEND}.focus()"));
    browser.key("Enter", 13);
    let state = format!("{LEGEND}.getAttribute('aria-pressed')");
    let drawn = format!(
        "(() => {{ const colour = {LEGEND}.querySelector('path').getAttribute('stroke'); \
         return [...{CHART}.querySelectorAll('g[aria-label=line] path')]\
         .filter(path => path.getAttribute('stroke') === colour).length; }})()"
    );
    assert_eq!((browser.text(&state), browser.value(&drawn)), ("false".into(), json!(0)));
    let at = browser.centre(LEGEND);
    browser.mouse("mousePressed", at);
    browser.mouse("mouseReleased", at);
    assert_eq!((browser.text(&state), browser.value(&drawn)), ("true".into(), json!(1)));

    let marks = format!("{CHART}.querySelectorAll('g[aria-label=dot] > *')");
    let all = browser.value(&format!("{marks}.length"));
    let from = browser.centre(&format!("{marks}[1]"));
    browser.drag(from, [from[0] + 60.0, from[1] + 60.0]);
    assert_eq!(browser.value(WHOLE), false);
    assert_ne!(browser.value(&format!("{marks}.length")), all);
    browser.key("Escape", 27);
    assert_eq!(browser.value(WHOLE), true);

    browser.value(&format!("{CHART}.focus()"));
    browser.key("+", 187);
    assert_eq!(browser.value(WHOLE), false);
    browser.key("-", 189);
    assert_eq!(browser.value(WHOLE), true);
    let larger = browser.centre("document.querySelector('figure.plot [aria-label=enlarge]')");
    browser.mouse("mousePressed", larger);
    browser.mouse("mouseReleased", larger);
    assert_eq!(browser.value(WHOLE), false);
    browser.value("document.querySelector('figure.plot .whole').click()");
    assert_eq!(browser.value(WHOLE), true);
}

/// A cube, and the medial mesh of a smaller one in it.
fn write_views(folder: &Path, records: &[Record]) {
    let corner = |k: u32| Vec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
    let square = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
    let sides =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let vertices = (0..8).map(corner).collect();
    let surface = TriMesh { vertices, faces: sides.into_iter().flat_map(square).collect() };
    let ball = |x, y, r| Sphere::new(Vec3::new(x, y, 0.5), r);
    let spheres = vec![ball(0.3, 0.3, 0.3), ball(0.7, 0.3, 0.25), ball(0.7, 0.7, 0.2)];
    let axis = MedialMesh::from_simplices(spheres, vec![], vec![[0, 1, 2]]).unwrap();
    std::fs::create_dir(folder.join("views")).unwrap();
    for strip in picture_strips(records) {
        let results = strip.panels.iter().map(|(_, caption)| (caption.clone(), &axis)).collect();
        let script = View3d::new(&surface, results).unwrap().script(&strip.view).unwrap();
        std::fs::write(folder.join(strip.view_file()), script).unwrap();
    }
}

/// How many pixels of a 3D view are drawn, and a sum that tells two pictures apart.
const DRAWN: &str = "window.drawn = (canvas) => { \
    const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext('2d'); \
    copy.drawImage(canvas, 0, 0); \
    const pixels = copy.getImageData(0, 0, canvas.width, canvas.height).data; \
    let count = 0, sum = 0; \
    for (let k = 0; k < pixels.length; k += 4) if (pixels[k + 3]) { \
        count += 1; sum = (sum * 31 + k + pixels[k] + pixels[k + 1]) % 1000003; } \
    return { count, sum }; }";

/// Both sides show something, move together, and are gone when they are closed.
fn check_views(browser: &mut Browser) {
    browser.value(DRAWN);
    let canvases = "[...document.querySelectorAll('.side canvas')]";
    let all_drawn =
        format!("{canvases}.length === 2 && {canvases}.every(c => drawn(c).count > 5000)");
    browser.value("document.querySelector('.view3d > button').click()");
    browser.until(&all_drawn);
    for kind in ["union", "errors", "surface", "axis"] {
        browser.value(&format!(
            "window.before = {canvases}.map(c => drawn(c).sum); \
             for (const side of document.querySelectorAll('.side')) {{ \
             const select = side.querySelectorAll('select')[1]; select.value = '{kind}'; \
             select.dispatchEvent(new Event('change')); }}"
        ));
        browser.until(&format!("{canvases}.every((c, k) => drawn(c).sum !== before[k])"));
        assert_eq!(browser.value(&all_drawn), true, "{kind}");
    }
    browser.value(&format!("before = {canvases}.map(c => drawn(c).sum); {canvases}[1].focus()"));
    browser.key("ArrowRight", 39);
    browser.until(&format!("{canvases}.every((c, k) => drawn(c).sum !== before[k])"));
    // The same results on both sides, seen alike.
    let sums = browser.value(&format!("{canvases}.map(c => drawn(c).sum)"));
    assert_eq!(sums[0], sums[1]);

    // Another one, from its file, takes the place of the first.
    browser.value("document.querySelectorAll('script.view')[1].remove()");
    browser.value("location.hash = '#mesh-dolphin'");
    let second = "document.querySelector('#mesh-dolphin .view3d')";
    browser.until(&format!("{second} !== null"));
    browser.value(&format!("{second}.querySelector('button').click()"));
    browser.until(&format!("{second}.querySelectorAll('canvas').length === 2"));
    browser.until(&all_drawn);
    browser.value(&format!("{second}.querySelector('button').click()"));
    assert_eq!(browser.value(&format!("{canvases}.length")), 0);
}

/// A button copies its text, or selects it where the browser lets no page copy.
fn check_papers(browser: &mut Browser) {
    browser.value("location.hash = '#papers'");
    browser.until("document.getElementById('papers').open");
    browser.value("window.copied = [...document.querySelectorAll('.paste')].pop()");
    let at = browser.centre("copied.querySelector('button')");
    browser.mouse("mousePressed", at);
    browser.mouse("mouseReleased", at);
    browser.until("copied.querySelector('output').textContent !== ''");
    if browser.text("copied.querySelector('output').textContent").starts_with("Selected") {
        let selected = browser.text("getSelection().toString()");
        assert!(selected.starts_with("@article{qmat,") && selected.contains("@misc{medial,"));
    }
    // And where there is nothing to copy with.
    browser.value(
        "{ Object.defineProperty(navigator, 'clipboard', {value: undefined}); \
         copied.querySelector('button').click(); }",
    );
    browser.until("copied.querySelector('output').textContent.startsWith('Selected')");
    let selected = browser.text("getSelection().toString()");
    assert!(selected.starts_with("@article{qmat,") && selected.contains("@misc{medial,"));
}

#[test]
fn the_page_answers_from_disk() {
    let folder = tempfile::tempdir().unwrap();
    let profile = tempfile::tempdir().unwrap();
    let Some(mut browser) = Browser::start(profile.path()) else { return };
    let records = comparison(&SHAPES, &METHODS, &COUNTS);
    write_views(folder.path(), &records);
    write_report(folder.path(), &records, &header(&METHODS)).unwrap();
    browser.open(&format!("file://{}/index.html", folder.path().display()));
    check_filters(&mut browser);
    check_address(&mut browser);
    check_meshes(&mut browser);
    check_details(&mut browser);
    check_sticky(&mut browser);
    check_plots(&mut browser);
    check_views(&mut browser);
    check_papers(&mut browser);

    let mut requests = 0;
    for event in &browser.events {
        let params = &event["params"];
        match event["method"].as_str().unwrap_or_default() {
            "Network.requestWillBeSent" => {
                let url = params["request"]["url"].as_str().unwrap();
                // Scripts that the page makes of its own text.
                if url.starts_with("blob:") {
                    continue;
                }
                assert!(url.starts_with("file:"), "{url}");
                requests += 1;
            }
            "Runtime.exceptionThrown" => panic!("{params}"),
            "Runtime.consoleAPICalled" => assert_ne!(params["type"], "error", "{params}"),
            "Log.entryAdded" => assert_ne!(params["entry"]["level"], "error", "{params}"),
            _ => {}
        }
    }
    assert_eq!(requests, 2, "the page and the view that it does not hold");
}
