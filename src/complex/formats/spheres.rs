//! Lists of spheres as robot planners and granular simulations use them.
//!
//! | extension | layout |
//! |---|---|
//! | `.csv` | rows `x,y,z,r` below a header |
//! | `.txt`, `.xyzr` | rows `x y z r` without a header: clumps of spheres |
//! | `.sph` | a tree of spheres: depth and branching factor, then rows `x y z r error` by levels (read only) |
//! | `.json` | `{"spheres": [{"center": [x, y, z], "radius": r}, ...]}`; read also `{"centers": [...], "radii": [...]}` of MorphIt |
//! | `.yaml`, `.yml` | `collision_spheres: {LINK: [{center: [x, y, z], radius: r}, ...]}` as cuRobo reads it |
//! | `.xrdf` | the sections `collision` and `geometry` of Isaac's Extended Robot Description Format |
//! | `.urdf` | `collision` elements with a `sphere`, of a `link` |
//! | `.xml` | MJCF: `geom` elements of type `sphere`, of a `body` |
//!
//! The link is named after the file. The readers search a document for lists of spheres, one for each link. They skip
//! other shapes and ignore frames and joints: a list is in the frame of its link. A `geom` of MJCF is a sphere by default,
//! and takes missing attributes from its default class.
//!
//! Sources: cuRobo, <https://curobo.org>; XRDF 1.0, <https://nvidia-isaac-ros.github.io/concepts/manipulation/xrdf.html>;
//! URDF, <https://wiki.ros.org/urdf/XML>; MJCF, <https://mujoco.readthedocs.io/en/stable/XMLreference.html>.

use std::array;
use std::collections::HashMap;
use std::fmt;
use std::io::{self, Write};
use std::path::Path;

use roxmltree::{Document, Node};
use serde::de::{Deserialize, Deserializer, Error as _, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Value, json};
use serde_saphyr::{MessageFormatter, NonFiniteFloatPolicy, UserMessageFormatter};

use super::ma::{canonical, comments_above, finite, lines, note, parse_ma};
use super::{LoadedMa, MaError, MaErrorKind, ReadOptions, extension};
use crate::complex::{MedialMesh, Sphere};
use crate::{Vec3, parser_message, quoted, shortened};

/// The text of a format: its extensions, and the text before all spheres, of each, between two, and behind all.
struct Layout(&'static [&'static str], &'static str, &'static str, &'static str, &'static str);

/// `{link}` is a quoted string.
const LAYOUTS: [Layout; 7] = [
    Layout(&["csv"], "x,y,z,r\n", "{x},{y},{z},{r}\n", "", ""),
    Layout(&["txt", "xyzr"], "", "{x} {y} {z} {r}\n", "", ""),
    Layout(
        &["json"],
        "{\"spheres\": [\n",
        "  {\"center\": [{x}, {y}, {z}], \"radius\": {r}}",
        ",\n",
        "\n]}\n",
    ),
    Layout(
        &["yaml", "yml"],
        "collision_spheres:\n  {link}:\n",
        "    - center: [{x}, {y}, {z}]\n      radius: {r}\n",
        "",
        "",
    ),
    Layout(
        &["xrdf"],
        "format: xrdf\nformat_version: 1.0\ncollision:\n  geometry: {link}\ngeometry:\n  {link}:\n    spheres:\n      \
         {link}:\n",
        "        - center: [{x}, {y}, {z}]\n          radius: {r}\n",
        "",
        "",
    ),
    Layout(
        &["urdf"],
        "<?xml version=\"1.0\"?>\n<robot name={link}>\n  <link name={link}>\n",
        "    <collision><origin xyz=\"{x} {y} {z}\" rpy=\"0 0 0\"/><geometry><sphere radius=\"{r}\"/></geometry>\
         </collision>\n",
        "",
        "  </link>\n</robot>\n",
    ),
    Layout(
        &["xml"],
        "<mujoco model={link}>\n  <worldbody>\n    <body name={link}>\n",
        "      <geom type=\"sphere\" pos=\"{x} {y} {z}\" size=\"{r}\"/>\n",
        "",
        "    </body>\n  </worldbody>\n</mujoco>\n",
    ),
];

fn layout(extension: &str) -> Option<&'static Layout> {
    LAYOUTS.iter().find(|layout| layout.0.contains(&extension))
}

/// Whether a file of this name holds spheres without edges and faces.
pub fn holds_spheres_alone(path: impl AsRef<Path>) -> bool {
    layout(&extension(path.as_ref())).is_some()
}

/// The elements of a medial mesh that a file of this name cannot hold, as a note; `None` if it holds all.
///
/// ```
/// use medial::complex::{MedialMesh, Sphere, left_out};
///
/// let spheres = [0.0, 1.0].map(|x| Sphere::new(medial::Vec3::new(x, 0.0, 0.0), 0.5));
/// let mesh = MedialMesh::from_simplices(spheres.to_vec(), vec![[0, 1]], vec![])?;
/// assert_eq!(left_out("arm.ma", &mesh), None);
/// assert_eq!(left_out("arm.csv", &mesh).unwrap(), "left out 1 edge and 0 faces: .csv holds spheres alone");
/// # Ok::<(), medial::complex::ComplexError>(())
/// ```
pub fn left_out(path: impl AsRef<Path>, mesh: &MedialMesh) -> Option<String> {
    let extension = extension(path.as_ref());
    if mesh.edges.is_empty() || !holds_spheres_alone(path) {
        return None;
    }
    let [edges, faces] = [(mesh.edges.len(), "edge"), (mesh.faces.len(), "face")]
        .map(|(count, one)| format!("{count} {one}{}", if count == 1 { "" } else { "s" }));
    Some(format!("left out {edges} and {faces}: .{extension} holds spheres alone"))
}

/// Writes the spheres of a mesh into the file `path`, whose extension is one of [`LAYOUTS`].
pub(super) fn write_spheres(out: &mut dyn Write, path: &Path, mesh: &MedialMesh) -> io::Result<()> {
    let extension = extension(path);
    let Layout(_, head, row, between, tail) = layout(&extension).expect("a format of spheres");
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let link = stem.replace(char::is_control, "_");
    let link = match &*extension {
        "urdf" | "xml" => {
            let escaped = link.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
            format!("\"{escaped}\"")
        }
        _ => Value::from(link).to_string(),
    };
    write!(out, "{}", head.replace("{link}", &link))?;
    for (k, Sphere { centre, radius }) in mesh.spheres.iter().enumerate() {
        let numbers = [("{x}", centre.x), ("{y}", centre.y), ("{z}", centre.z), ("{r}", *radius)];
        let text = numbers.iter().fold((*row).to_owned(), |text, (field, number)| {
            text.replace(field, &decimal(*number))
        });
        write!(out, "{}{text}", if k > 0 { between } else { "" })?;
    }
    write!(out, "{tail}")
}

/// The shortest decimal that is read back as this number, with a point and without an exponent: `1e-5` is a text to
/// readers of YAML 1.1, and `1` may be an index.
fn decimal(number: f64) -> String {
    let text = number.to_string();
    if text.contains('.') { text } else { text + ".0" }
}

type Loaded = Result<LoadedMa, MaError>;

fn malformed(name: &str, line: Option<usize>, why: String) -> MaError {
    MaError { line, ..MaError::of(name, MaErrorKind::Malformed(why)) }
}

/// The spheres of one link.
#[derive(Default)]
struct Link {
    name: String,
    spheres: Vec<Sphere>,
    /// Elements of other shapes.
    others: usize,
}

/// The spheres of the requested link as a medial mesh; `name` is the file in errors.
fn chosen(mut links: Vec<Link>, name: &str, options: ReadOptions) -> Loaded {
    let refused = |why| Err(malformed(name, None, why));
    let others: usize = links.iter().map(|link| link.others).sum();
    links.retain(|link| !link.spheres.is_empty());
    let count = links.len();
    let index = match (options.block, count) {
        (_, 0) if others > 0 => {
            return refused(format!("no spheres (found {others} other shapes)"));
        }
        (_, 0) => return refused("no spheres".to_owned()),
        (None, 1) => 0,
        (None, _) => {
            let listed = links.iter().enumerate().take(MOST_LISTED);
            let listed: Vec<String> =
                listed.map(|(k, link)| format!("{} {}", k + 1, shortened(&link.name))).collect();
            let more = if count > MOST_LISTED { ", ..." } else { "" };
            let listed = listed.join(", ");
            return refused(format!("{count} links ({listed}{more}); select one by --block K"));
        }
        (Some(k), _) if (1..=count).contains(&k) => k - 1,
        (Some(k), _) => {
            let why = format!("there is no block {k}: the file holds {count}, counted from 1");
            return refused(why);
        }
    };
    let Link { mut spheres, others, .. } = links.swap_remove(index);
    let mut notes = Vec::new();
    note(&mut notes, others, "element", "skipped: not a sphere");
    let all = spheres.len();
    // cuRobo switches spheres off by a negative radius.
    spheres.retain(|sphere| sphere.radius >= 0.0);
    note(&mut notes, all - spheres.len(), "sphere", "dropped: negative radius");
    if spheres.is_empty() {
        return refused(format!("no spheres (found {all} with a negative radius)"));
    }
    canonical(spheres, vec![], vec![], options.radii, notes).map_err(|kind| MaError::of(name, kind))
}

/// Most links that an error lists.
const MOST_LISTED: usize = 60;

/// Reads rows `x,y,z,r` or `x y z r`, below a header or without one. Every row has as many fields as the first: a
/// decimal comma or a separator of thousands would shift the others.
pub(super) fn parse_rows(bytes: &[u8], name: &str, options: ReadOptions) -> Loaded {
    let mut columns = [0, 1, 2, 3];
    let mut link = Link::default();
    let (mut separator, mut width) = (None, COLUMNS.len());
    for (k, line) in lines(bytes, name).enumerate() {
        if k == 0 {
            separator = separator_of(&line.text);
        }
        let fields = fields(&line.text, separator);
        let is_header = k == 0 && fields.iter().all(|field| field.parse::<f64>().is_err());
        if is_header {
            columns = columns_of(&fields).map_err(|why| line.malformed(why))?;
            width = fields.len();
            continue;
        }
        if k == 0
            && let Some(found) = columns_of_comments(bytes, fields.len())
        {
            columns = found.map_err(|why| line.malformed(why))?;
            width = fields.len();
        }
        if fields.len() != width {
            let found = quoted(&line.text);
            let why = format!("{} fields instead of {width} (found {found})", fields.len());
            return Err(
                line.malformed(why + "; write decimal points and no separators of thousands")
            );
        }
        let mut numbers = [0.0; 4];
        for ((number, column), known) in numbers.iter_mut().zip(columns).zip(COLUMNS) {
            *number = finite(fields[column], known).map_err(|why| {
                let is_comma = fields[column].contains(',');
                line.malformed(why + if is_comma { "; write a decimal point" } else { "" })
            })?;
        }
        let [x, y, z, radius] = numbers;
        link.spheres.push(Sphere::new(Vec3::new(x, y, z), radius));
    }
    chosen(vec![link], name, options)
}

/// Names of the columns in messages.
const COLUMNS: [&str; 4] = ["x", "y", "z", "r"];

fn is_column(field: &str, name: &str) -> bool {
    field.trim_matches('"').eq_ignore_ascii_case(name)
}

/// The columns named by `count` consecutive words of a comment above the rows. Other comments are prose; one about a
/// diameter is an error.
fn columns_of_comments(bytes: &[u8], count: usize) -> Option<Result<[usize; 4], String>> {
    const RADII: [&str; 4] = ["r", "radius", "d", "diameter"];
    let comments = comments_above(bytes);
    let parts = comments.iter().rev().flat_map(|comment| comment.split(':'));
    let named = parts.filter_map(|part| {
        let is_list = separator_of(part).is_some();
        let listed = fields(part, separator_of(part)).into_iter().map(without_unit).collect();
        let words = part.split([' ', '\t', ',', ';']).map(without_unit);
        let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
        [listed, words].into_iter().find_map(|names: Vec<&str>| {
            // Of x, y, z and a radius the names up to and with the last one.
            let mut last = [0; 4];
            let end = (1..=names.len()).find(|&end| {
                for (last, kind) in last.iter_mut().zip([&["x"][..], &["y"], &["z"], &RADII]) {
                    if kind.iter().any(|column| is_column(names[end - 1], column)) {
                        *last = end;
                    }
                }
                let has = last.map(|last| last + count > end);
                // Four words about the radius are prose.
                let is_header = match count == names.len() {
                    true => has[0] || is_list && has[3],
                    false => has == [true; 4],
                };
                end >= count && is_header
            });
            end.map(|end| columns_of(&names[end - count..end]))
        })
    });
    let is_diameter = |comment: &&String| comment.to_ascii_lowercase().contains("diameter");
    named.into_iter().next().or_else(|| {
        let found = quoted(comments.iter().find(is_diameter)?);
        Some(Err(format!("unclear columns in a comment (found {found}, expected x,y,z,r)")))
    })
}

/// The first word of a name, without a unit in brackets.
fn without_unit(name: &str) -> &str {
    let word = name.split_whitespace().next().unwrap_or_default();
    let word = if word.ends_with([']', ')']) { word } else { word.trim_start_matches(['[', '(']) };
    word.split(['[', '(']).next().unwrap_or_default().trim_end_matches([']', ')'])
}

/// The places of `x`, `y`, `z` and the radius among the names of a header.
fn columns_of(names: &[&str]) -> Result<[usize; 4], String> {
    let found = || quoted(&names.join(","));
    let place = |column: &str| {
        let mut places = (0..names.len()).filter(|&k| is_column(names[k], column));
        match (places.next(), places.next()) {
            (Some(_), Some(_)) => Err(format!("two columns {column} (found {})", found())),
            (place, _) => Ok(place),
        }
    };
    // With green and blue, `r` is red.
    let has =
        |columns: [&str; 2]| names.iter().any(|name| columns.iter().any(|c| is_column(name, c)));
    let has_colour = has(["g", "green"]) && has(["b", "blue"]);
    let radius = match (place("radius")?, if has_colour { None } else { place("r")? }) {
        (Some(_), Some(_)) => {
            return Err(format!("two columns of radii, r and radius (found {})", found()));
        }
        (radius, r) => radius.or(r),
    };
    let mut columns = [0; 4];
    for ((column, name), place) in
        columns.iter_mut().zip(COLUMNS).zip([place("x")?, place("y")?, place("z")?, radius])
    {
        let missing = || format!("no column {name} (found {}, expected x,y,z,r)", found());
        *column = place.ok_or_else(missing)?;
    }
    Ok(columns)
}

/// The separator of a list by its first line: semicolons before commas, which can be decimal. `None` for blanks.
fn separator_of(line: &str) -> Option<char> {
    [';', ','].into_iter().find(|separator| line.contains(*separator))
}

fn fields(line: &str, separator: Option<char>) -> Vec<&str> {
    match separator {
        Some(separator) => line.split(separator).map(str::trim).collect(),
        None => line.split_ascii_whitespace().collect(),
    }
}

/// Reads rows of four numbers, or the lists of [`parse_ma`], which share their extensions.
pub(super) fn parse_clump(bytes: &[u8], name: &str, options: ReadOptions) -> Loaded {
    // The first line of the others can be four counts; the second of none is four numbers then.
    let is_row = |text: &str| {
        let fields = fields(text, separator_of(text));
        let are_numbers = fields.iter().all(|field| field.parse::<f64>().is_ok());
        fields.len() == 4 && (are_numbers || fields[0].eq_ignore_ascii_case("x"))
    };
    let mut first = lines(bytes, name).take(2).peekable();
    let is_clump = first.peek().is_some() && first.all(|line| is_row(&line.text));
    if is_clump {
        return parse_rows(bytes, name, options);
    }
    match columns_of_comments(bytes, COLUMNS.len()) {
        None | Some(Ok([0, 1, 2, 3])) => parse_ma(bytes, name, options),
        Some(Err(why)) => Err(malformed(name, None, why)),
        Some(Ok(_)) => {
            let why =
                "a comment names other columns (expected x y z r); write a list without counts";
            Err(malformed(name, None, why.to_owned()))
        }
    }
}

/// Reads the deepest level of a tree of spheres, as the sphere-tree toolkit writes it, or the lists of [`parse_clump`].
pub(super) fn parse_tree(bytes: &[u8], name: &str, options: ReadOptions) -> Loaded {
    let mut rows = lines(bytes, name);
    let header = rows.next().and_then(|line| {
        let words = line.text.split_ascii_whitespace().map(|word| word.parse::<usize>().ok());
        words.collect::<Option<Vec<usize>>>()
    });
    let rows: Vec<_> = rows.collect();
    let is_row = |text: &str| text.split_ascii_whitespace().count() == 5;
    let (announced, children) = match header.as_deref() {
        // MATTopo announces the number of rows.
        Some(&[depth, children])
            if ![depth, children].contains(&rows.len())
                && rows.first().is_some_and(|line| is_row(&line.text)) =>
        {
            (depth, children)
        }
        _ => return parse_clump(bytes, name, options),
    };
    let mut spheres = Vec::new();
    for line in rows {
        let words: Vec<&str> = line.text.split_ascii_whitespace().collect();
        let &[x, y, z, radius, _error] = &words[..] else {
            let why = format!("{} fields instead of 5 (x y z r error)", words.len());
            return Err(line.malformed(why));
        };
        let number = |word, known| finite(word, known).map_err(|why| line.malformed(why));
        let centre = Vec3::new(number(x, "x")?, number(y, "y")?, number(z, "z")?);
        spheres.push(Sphere::new(centre, number(radius, "radius")?));
    }
    let (mut above, mut level, mut levels) = (0, 1_usize, 1);
    while level > 0 && level < spheres.len() - above {
        above += level;
        level = level.saturating_mul(children);
        levels += 1;
    }
    if level != spheres.len() - above {
        let why = format!("{} rows are no whole levels with {children} children", spheres.len());
        return Err(malformed(name, None, why));
    }
    // A place without a sphere has no radius. Spheres without any below them stand for the region below.
    let is_there = |k: usize| spheres.get(k).is_some_and(|sphere| sphere.radius > 0.0);
    let has_below = |k: usize| (1..=children).any(|child| is_there(k * children + child));
    let lowest: Vec<usize> =
        (0..spheres.len()).filter(|&k| is_there(k) && (k >= above || !has_below(k))).collect();
    let early = lowest.iter().filter(|&&k| k < above).count();
    let spheres = lowest.into_iter().map(|k| spheres[k]).collect();
    let mut loaded = chosen(vec![Link { spheres, ..Link::default() }], name, options)?;
    let notes = [
        (above > 0).then(|| format!("took the deepest of {levels} levels")),
        (early > 0).then(|| format!("spheres of higher levels without any below them: {early}")),
        // Writers count the root, or do not.
        (![announced, announced.saturating_add(1)].contains(&levels))
            .then(|| format!("the header announces {announced} levels, the file holds {levels}")),
    ];
    loaded.notes.extend(notes.into_iter().flatten());
    Ok(loaded)
}

/// Reads every list of spheres in a JSON document: an object for each, with `center` or `origin`, and `radius`.
pub(super) fn parse_json(bytes: &[u8], name: &str, options: ReadOptions) -> Loaded {
    let Unique(document) = serde_json::from_slice(bytes).map_err(|error| {
        let line = Some(error.line()).filter(|&line| line > 0);
        malformed(name, line, parser_message(&error.to_string()))
    })?;
    from_document(&document, name, options)
}

/// A value of JSON without an object that has a key twice, of which one list would be lost.
struct Unique(Value);

impl<'de> Deserialize<'de> for Unique {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(UniqueVisitor).map(Self)
    }
}

struct UniqueVisitor;

impl<'de> Visitor<'de> for UniqueVisitor {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a value")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_f64<E>(self, value: f64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_str<E>(self, value: &str) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Value, A::Error> {
        let mut array = Vec::new();
        while let Some(Unique(item)) = items.next_element()? {
            array.push(item);
        }
        Ok(array.into())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Value, A::Error> {
        let mut object = Map::new();
        while let Some((key, Unique(value))) = entries.next_entry::<String, _>()? {
            if object.contains_key(&key) {
                return Err(A::Error::custom(format!("duplicate key {}", quoted(&key))));
            }
            object.insert(key, value);
        }
        Ok(object.into())
    }
}

/// [`parse_json`] for YAML: cuRobo's files, with or without the rest of the robot's configuration, and XRDF.
pub(super) fn parse_yaml(bytes: &[u8], name: &str, options: ReadOptions) -> Loaded {
    // Every node of a text takes a byte. Aliases, which repeat nodes, have a limit of their own.
    let budget = serde_saphyr::budget! {
        max_nodes: bytes.len() + 1, max_events: 2 * bytes.len() + 8,
    };
    let options_of_yaml = serde_saphyr::options! {
        budget: budget,
        with_snippet: false,
        // Other parts of a robot's configuration may hold them.
        non_finite_float_policy: NonFiniteFloatPolicy::AsString,
    };
    let read = serde_saphyr::from_slice_with_options(bytes, options_of_yaml);
    let document: Value = read.map_err(|error| {
        // The default messages name functions of the crate, and both its own limits.
        let why = UserMessageFormatter.format_message(error.without_snippet());
        let why = why.split(": limits breached").next().unwrap_or_default();
        let line = error.location().map(|location| location.line() as usize);
        malformed(name, line, parser_message(why))
    })?;
    from_document(&document, name, options)
}

fn from_document(document: &Value, name: &str, options: ReadOptions) -> Loaded {
    let mut links = Vec::new();
    let spheres = for_collisions(document).map_err(|why| malformed(name, None, why))?;
    collect(spheres, "", &mut links).map_err(|why| malformed(name, None, why))?;
    let mut loaded = chosen(links, name, options)?;
    for buffer in BUFFERS.into_iter().filter(|buffer| has_key(document, buffer)) {
        loaded.notes.push(format!("{buffer} was not added to the radii"));
    }
    Ok(loaded)
}

/// The geometry that the section `collision` of an XRDF document names, or the whole document.
fn for_collisions(document: &Value) -> Result<&Value, String> {
    let named = document.pointer("/collision/geometry").and_then(Value::as_str);
    let Some((named, geometry)) = named.zip(document.get("geometry")) else { return Ok(document) };
    geometry.get(named).ok_or_else(|| format!("collision: no geometry {}", quoted(named)))
}

/// Lengths that cuRobo and Isaac add to all radii, or to those of a link, when they use a file.
const BUFFERS: [&str; 2] = ["collision_sphere_buffer", "buffer_distance"];

/// Whether some object in a document has a key with another value than zero, or than zeros by link.
fn has_key(document: &Value, key: &str) -> bool {
    let is_zero = |value: &Value| value.as_f64() == Some(0.0);
    match document {
        Value::Array(items) => items.iter().any(|item| has_key(item, key)),
        Value::Object(map) => {
            let is_none = |value: &Value| match value {
                Value::Object(links) => links.values().all(is_zero),
                other => is_zero(other),
            };
            map.get(key).is_some_and(|value| !is_none(value))
                || map.values().any(|value| has_key(value, key))
        }
        _ => false,
    }
}

/// Adds the lists of spheres in `value`, whose key is `key`. The readers bound the depth of `value`.
fn collect(value: &Value, key: &str, links: &mut Vec<Link>) -> Result<(), String> {
    match value {
        Value::Array(items) if items.iter().any(has_centre) => {
            let numbered =
                items.iter().enumerate().map(|(k, item)| (format!("sphere {}", k + 1), item));
            links.push(link_of(key, numbered)?);
            // Spheres of a hierarchy have others inside.
            items.iter().filter_map(Value::as_object).try_for_each(|map| named(map, key, links))
        }
        Value::Array(items) => {
            let unnamed = items.iter().position(|item| has_radius(item) && has_point(item));
            if let Some(k) = unnamed {
                return Err(format!("{}, sphere {}: {}", shortened(key), k + 1, no_centre()));
            }
            items.iter().try_for_each(|item| collect(item, key, links))
        }
        Value::Object(map) => named(map, key, links),
        _ => Ok(()),
    }
}

/// Adds the spheres that are values of an object, and the lists below it. Next to a sphere, whatever is nearly one has to
/// be one: it would be lost.
fn named(map: &Map<String, Value>, key: &str, links: &mut Vec<Link>) -> Result<(), String> {
    if let (Some(Value::Array(centres)), Some(Value::Array(radii))) =
        (map.get("centers"), map.get("radii"))
    {
        if centres.len() != radii.len() {
            return Err(format!("{} centers and {} radii", centres.len(), radii.len()));
        }
        let of_each = centres.iter().zip(radii);
        let items = of_each.map(|(centre, radius)| json!({ "center": centre, "radius": radius }));
        collect(&Value::Array(items.collect()), key, links)?;
    }
    if map.values().any(|item| has_centre(item) && has_radius(item) && !is_other_shape(item)) {
        let alike = map.iter().filter(|(_, item)| has_centre(item) || has_radius(item));
        links.push(link_of(key, alike.map(|(name, item)| (shortened(name), item)))?);
    }
    map.iter().try_for_each(|(key, value)| collect(value, key, links))
}

/// The link of a list of spheres, each with its name in errors.
fn link_of<'a>(
    key: &str,
    items: impl Iterator<Item = (String, &'a Value)>,
) -> Result<Link, String> {
    let mut link = Link { name: key.to_owned(), ..Link::default() };
    for (name, item) in items {
        if is_other_shape(item) {
            link.others += 1;
        } else {
            let within = if key.is_empty() { String::new() } else { shortened(key) + ", " };
            let read = sphere(item).map_err(|why| format!("{within}{name}: {why}"));
            link.spheres.push(read?);
        }
    }
    Ok(link)
}

/// Whether an item is a box, a capsule or the like: by the name of its kind, or by a measure that spheres do not have.
fn is_other_shape(item: &Value) -> bool {
    let kind = ["type", "shape", "kind", "geometry", "class"].iter().find_map(|key| item.get(key));
    if let Some(kind) = kind.and_then(Value::as_str) {
        let kind = kind.to_ascii_lowercase();
        return !kind.contains("sphere") || ["hemi", "half"].iter().any(|part| kind.contains(part));
    }
    let is_measure = |value: &Value| match value {
        Value::Array(list) => !list.is_empty() && list.iter().all(Value::is_number),
        other => other.is_number(),
    };
    let mut entries = item.as_object().into_iter().flatten();
    entries.any(|(key, value)| {
        let key = key.to_ascii_lowercase();
        is_measure(value) && !CENTRES.iter().chain(&OF_SPHERES).any(|known| *known == key)
    })
}

/// Keys of numbers and vectors of spheres, other than [`CENTRES`].
const OF_SPHERES: [&str; 20] = [
    "radius", "r", "diameter", "position", "pos", "id", "index", "link", "parent", "group",
    "label", "color", "colour", "rgb", "rgba", "opacity", "mass", "weight", "density", "volume",
];

fn no_centre() -> String {
    format!("none of the names of a center: {}", CENTRES.join(", "))
}

fn has_radius(item: &Value) -> bool {
    ["radius", "r", "diameter"].iter().any(|key| item.get(key).is_some())
}

/// Whether a value of an object is a list of three numbers.
fn has_point(item: &Value) -> bool {
    let is_point = |value: &Value| {
        value.as_array().is_some_and(|list| list.len() == 3 && list.iter().all(Value::is_number))
    };
    item.as_object().is_some_and(|map| map.values().any(is_point))
}

/// Names of a centre.
const CENTRES: [&str; 3] = ["center", "origin", "centre"];

fn has_centre(item: &Value) -> bool {
    CENTRES.iter().any(|key| item.get(key).is_some())
}

fn sphere(item: &Value) -> Result<Sphere, String> {
    let number = |value: &Value, field: &str| {
        let number = value.as_f64().filter(|number| number.is_finite());
        number.ok_or_else(|| format!("the {field} {} is not a finite number", text(value)))
    };
    // YAML reads `radius: 0,5` as a radius of 0 and a key 5 without a value.
    let mut entries = item.as_object().into_iter().flatten();
    if let Some((key, _)) =
        entries.find(|(key, value)| value.is_null() && key.parse::<f64>().is_ok())
    {
        return Err(format!("the key {} is a number; write decimal points", quoted(key)));
    }
    let mut centres = CENTRES.iter().filter_map(|key| item.get(key));
    let centre = centres.next().ok_or_else(no_centre)?;
    if centres.next().is_some() {
        return Err("two centers".to_owned());
    }
    let Some([x, y, z]) = centre.as_array().map(Vec::as_slice) else {
        return Err(format!("the center {} is not a list of three numbers", text(centre)));
    };
    let [x, y, z] = [number(x, "x")?, number(y, "y")?, number(z, "z")?];
    let radius = number(item.get("radius").ok_or("the radius is missing")?, "radius")?;
    // Rounded decimals differ slightly. Next to green, `r` is red.
    let others = [("r", 1.0), ("diameter", 2.0)].into_iter();
    for (key, factor) in others.filter(|_| item.get("g").is_none()) {
        let other = item.get(key).and_then(Value::as_f64);
        if let Some(other) = other.filter(|x| (x - factor * radius).abs() > 0.01 * radius.abs()) {
            return Err(format!("the radius {radius} contradicts the {key} {other}"));
        }
    }
    Ok(Sphere::new(Vec3::new(x, y, z), radius))
}

fn text(value: &Value) -> String {
    value.as_str().map_or_else(|| shortened(&value.to_string()), quoted)
}

/// Reads the spheres of a URDF or MJCF document; its root element decides.
pub(super) fn parse_xml(bytes: &[u8], name: &str, options: ReadOptions) -> Loaded {
    let text = str::from_utf8(bytes).map_err(|error| malformed(name, None, error.to_string()))?;
    check_effort(text).map_err(|(row, why)| malformed(name, Some(row), why))?;
    let document = Document::parse(text).map_err(|error| {
        malformed(name, Some(error.pos().row as usize), parser_message(&error.to_string()))
    })?;
    let root = document.root_element().tag_name().name();
    let (owners, shape): (&[&str], &str) = match root {
        "robot" => (&["link"], "collision"),
        "mujoco" => (&["worldbody", "body"], "geom"),
        _ => {
            let found = quoted(root);
            let why = format!("unknown root element (found {found}, expected robot or mujoco)");
            return Err(malformed(name, None, why));
        }
    };
    let macros =
        |node: &Node<'_, '_>| node.tag_name().namespace().is_some_and(|n| n.contains("xacro"));
    if let Some(node) = document.descendants().find(macros) {
        let row = document.text_pos_at(node.range().start).row as usize;
        let why = "macros of xacro are not read; write the robot by `xacro FILE -o ROBOT.urdf`";
        return Err(malformed(name, Some(row), why.to_owned()));
    }
    // Positions in a frame are relative to it, and the others stand for elements that are not in the file.
    let unread = document.descendants().find(|node| UNREAD.contains(&node.tag_name().name()));
    if let Some(node) = unread.filter(|_| shape == "geom") {
        let row = document.text_pos_at(node.range().start).row as usize;
        let tag = node.tag_name().name();
        let why = format!("the element {tag} is not read; let MuJoCo resolve it by mj_saveLastXML");
        return Err(malformed(name, Some(row), why));
    }
    let classes = default_classes(&document);
    // Class of the shapes in each owner; owners of others come first.
    let mut class_of = HashMap::new();
    let mut links = Vec::new();
    for owner in document.descendants().filter(|node| owners.contains(&node.tag_name().name())) {
        let tag = owner.tag_name().name();
        let outer = owner.parent().and_then(|outer| class_of.get(&outer.id()).copied());
        let class = owner.attribute("childclass").or(outer).unwrap_or(MAIN);
        class_of.insert(owner.id(), class);
        let mut link =
            Link { name: owner.attribute("name").unwrap_or(tag).into(), ..Link::default() };
        for element in owner.children().filter(|child| child.has_tag_name(shape)) {
            let attributes = match shape {
                "geom" => of_geom(element, element.attribute("class").unwrap_or(class), &classes),
                _ => of_collision(element),
            };
            let sphere = attributes.and_then(|found| {
                found.map(|[centre, radius]| numbers(centre, radius, shape == "geom")).transpose()
            });
            match sphere {
                Ok(Some(sphere)) => link.spheres.push(sphere),
                Ok(None) => link.others += 1,
                Err(why) => {
                    // The search of a line reads the document from its start.
                    let row = document.text_pos_at(element.range().start).row as usize;
                    return Err(malformed(name, Some(row), why));
                }
            }
        }
        links.push(link);
    }
    chosen(links, name, options)
}

/// Most attributes of one element, and most namespace declarations of a document.
const MOST_OF_XML: usize = 500;

/// Refuses a document that takes the parser quadratic time: it compares the attributes of an element, and the namespaces
/// in scope, in pairs. The error has the row.
fn check_effort(text: &str) -> Result<(), (usize, String)> {
    let (mut rest, mut declarations) = (text, 0);
    while let Some(start) = rest.find('<') {
        rest = &rest[start..];
        let spans = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")];
        if let Some((open, close)) = spans.into_iter().find(|(open, _)| rest.starts_with(open)) {
            let end = rest[open.len()..].find(close).unwrap_or(rest.len() - open.len());
            rest = &rest[open.len() + end..];
            continue;
        }
        let (mut quote, mut attributes) = (None, 0);
        let end = rest.find(|c| {
            match quote {
                None if c == '"' || c == '\'' => (quote, attributes) = (Some(c), attributes + 1),
                Some(open) if c == open => quote = None,
                _ => {}
            }
            c == '>' && quote.is_none()
        });
        let tag = &rest[1..end.unwrap_or(rest.len())];
        declarations += tag.matches("xmlns").count();
        for (count, what) in [(attributes, "attributes"), (declarations, "namespace declarations")]
        {
            if count > MOST_OF_XML {
                let row = 1 + text[..text.len() - rest.len()].matches('\n').count();
                let element = quoted(tag.split_ascii_whitespace().next().unwrap_or_default());
                let why = format!("element {element}: more than {MOST_OF_XML} {what}");
                return Err((row, why));
            }
        }
        rest = &rest[1 + tag.len()..];
    }
    Ok(())
}

fn child<'a, 'i>(parent: Node<'a, 'i>, tag: &str) -> Option<Node<'a, 'i>> {
    parent.children().find(|node| node.has_tag_name(tag))
}

/// Elements of MJCF that are not read.
const UNREAD: [&str; 6] = ["frame", "replicate", "include", "attach", "composite", "flexcomp"];

/// Text of the centre and of the radius; `None` for another shape.
type Attributes<'a> = Result<Option<[&'a str; 2]>, String>;

/// The attributes of a `collision` element.
fn of_collision<'a>(element: Node<'a, '_>) -> Attributes<'a> {
    let shapes = element.children().filter(|node| node.has_tag_name("geometry"));
    let mut shapes = shapes.flat_map(|geometry| geometry.children()).filter(Node::is_element);
    let shape = shapes.next();
    if shapes.next().is_some() {
        return Err("several shapes in one collision element; give one to each".to_owned());
    }
    let mut origins = element.children().filter(|node| node.has_tag_name("origin"));
    let origin = origins.next().and_then(|origin| origin.attribute("xyz"));
    if origins.next().is_some() {
        return Err("several origins in one collision element".to_owned());
    }
    // Without a position, a shape is at the origin of its link.
    let sphere = shape.filter(|shape| shape.has_tag_name("sphere"));
    Ok(sphere
        .map(|sphere| [origin.unwrap_or("0 0 0"), sphere.attribute("radius").unwrap_or_default()]))
}

/// Attributes of a `geom`, its own or of its default class.
const GEOM: [&str; 7] = ["type", "mesh", "fromto", "pos", "size", "contype", "conaffinity"];

/// Values of [`GEOM`].
type Geom<'a> = [Option<&'a str>; 7];

/// Key of the outermost default class, which may have any name.
const MAIN: &str = "";

fn with_defaults<'a>(element: Node<'a, '_>, defaults: Geom<'a>) -> Geom<'a> {
    array::from_fn(|k| element.attribute(GEOM[k]).or(defaults[k]))
}

/// The defaults of the `geom` elements of each class, with those of the classes around it.
fn default_classes<'a>(document: &'a Document<'_>) -> HashMap<&'a str, Geom<'a>> {
    let mut classes: HashMap<&str, Geom<'_>> = HashMap::new();
    // Outer classes come first.
    for class in document.descendants().filter(|node| node.has_tag_name("default")) {
        let outer = class.parent().filter(|outer| outer.has_tag_name("default"));
        let outer_name = outer.and_then(|outer| outer.attribute("class")).unwrap_or(MAIN);
        let inherited = classes.get(outer_name).copied().unwrap_or_default();
        let own = child(class, "geom").map_or(inherited, |geom| with_defaults(geom, inherited));
        classes.extend(class.attribute("class").map(|name| (name, own)));
        if outer.is_none() {
            classes.insert(MAIN, own);
        }
    }
    classes
}

/// The attributes of a `geom` element.
fn of_geom<'a>(
    element: Node<'a, '_>,
    class: &str,
    classes: &HashMap<&str, Geom<'a>>,
) -> Attributes<'a> {
    let defaults = match classes.get(class) {
        Some(defaults) => *defaults,
        // The outermost class has this name where the file gives it none.
        None if [MAIN, "main"].contains(&class) => classes.get(MAIN).copied().unwrap_or_default(),
        None => return Err(format!("unknown class {}", quoted(class))),
    };
    let [kind, mesh, ends, centre, radius, of_own, of_others] = with_defaults(element, defaults);
    // One that nothing collides with is for the eye.
    let collides =
        [of_own, of_others].iter().any(|mask| mask.is_none_or(|mask| mask.trim() != "0"));
    // MuJoCo fits a sphere to the mesh, which this reader does not have. Ends belong to capsules and boxes.
    let is_sphere =
        kind.unwrap_or("sphere") == "sphere" && mesh.is_none() && ends.is_none() && collides;
    Ok(is_sphere.then(|| [centre.unwrap_or("0 0 0"), radius.unwrap_or_default()]))
}

/// A sphere from its attributes. MJCF allows three sizes, of which a sphere uses the first.
fn numbers(centre: &str, radius: &str, allows_sizes: bool) -> Result<Sphere, String> {
    let [x, y, z] = *centre.split_ascii_whitespace().collect::<Vec<_>>() else {
        return Err(format!("the position {} is not three numbers", quoted(centre)));
    };
    let centre = Vec3::new(finite(x, "x")?, finite(y, "y")?, finite(z, "z")?);
    let mut sizes = radius.split_ascii_whitespace();
    let size = sizes.next().ok_or("the radius is missing")?;
    if sizes.next().is_some() && !allows_sizes {
        return Err(format!("the radius {} is not one number", quoted(radius)));
    }
    Ok(Sphere::new(centre, finite(size, "radius")?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::complex::{WRITABLE, read, read_content, write};

    fn load(name: &str, text: &str) -> Result<LoadedMa, MaError> {
        read_content(name, text.as_bytes(), ReadOptions::default())
    }

    fn radii(name: &str, text: &str) -> Vec<f64> {
        let loaded = load(name, text).unwrap_or_else(|error| panic!("{text}: {error}"));
        loaded.mesh.spheres.iter().map(|sphere| sphere.radius).collect()
    }

    #[test]
    fn every_number_is_read_back_bit_for_bit() {
        let numbers = [0.1, -1.0 / 3.0, 1e-300, -0.0, 6.02e23, f64::MIN_POSITIVE, 0.5, 1e200, 7.0];
        let spheres = (0..numbers.len()).map(|i| {
            let [x, y, z, r] = [0, 1, 2, 3].map(|k| numbers[(i + k) % numbers.len()]);
            Sphere::new(Vec3::new(x, y, z), r.abs())
        });
        let mesh = MedialMesh::from_simplices(spheres.collect(), vec![[0, 1]], vec![]).unwrap();
        let folder = tempfile::tempdir().unwrap();
        for extension in LAYOUTS.iter().flat_map(|layout| layout.0) {
            assert!(WRITABLE.contains(extension));
            // A name that must be quoted in YAML and escaped in XML.
            let path = folder.path().join(format!("{{x}} & <\"12\">: 'a'.{extension}"));
            write(&path, &mesh).unwrap();
            let loaded = read(&path).unwrap();
            assert_eq!(
                (&loaded.mesh.spheres, loaded.notes),
                (&mesh.spheres, vec![]),
                "{extension}"
            );
            let bits = |mesh: &MedialMesh| {
                let numbers = mesh.spheres.iter().flat_map(|s| s.centre.to_array());
                numbers.map(f64::to_bits).collect::<Vec<_>>()
            };
            assert_eq!(bits(&loaded.mesh), bits(&mesh), "{extension}");
            let error = write(&path, &MedialMesh::default()).unwrap_err().to_string();
            assert!(error.ends_with(": no sphere to write"), "{error}");
        }
    }

    #[test]
    fn text_in_two_bytes_a_character_is_named() {
        let bytes: Vec<u8> = "\u{feff}[]\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
        let error = read_content("x.json", &bytes, ReadOptions::default()).unwrap_err().to_string();
        assert!(error.contains("UTF-16"), "{error}");
    }

    #[test]
    fn layouts_of_other_programs_are_read() {
        let curobo = "robot_cfg:\n  kinematics:\n    collision_spheres:\n      a: &a\n        - \"center\": [0, 0, 1.0e-1]\n          \
                      \"radius\": 0.5 # m\n        - {center: [0, 0, 0], radius: -10}\n      b: []\n";
        let loaded = load("x.yml", curobo).unwrap();
        assert_eq!(loaded.mesh.spheres, [Sphere::new(Vec3::new(0.0, 0.0, 0.1), 0.5)]);
        assert_eq!(loaded.notes, ["1 sphere was dropped: negative radius"]);
        let buffer = "collision_sphere_buffer: 0.01\na: [{center: [0, 0, 0], radius: 1}]\n";
        let notes = load("x.yml", buffer).unwrap().notes;
        assert_eq!(notes, ["collision_sphere_buffer was not added to the radii"]);
        let xrdf = "collision:\n  geometry: g\n  buffer_distance: {a: 0.0, b: 0.02}\ngeometry:\n  g:\n    spheres:\n      \
                    a: [{center: [0, 0, 0], radius: 1}]\n";
        let notes = load("x.xrdf", xrdf).unwrap().notes;
        assert_eq!(notes, ["buffer_distance was not added to the radii"]);
        for none in ["0", "{}", "{a: 0, b: 0.0}"] {
            let xrdf = xrdf.replace("{a: 0.0, b: 0.02}", none);
            assert_eq!(load("x.xrdf", &xrdf).unwrap().notes, Vec::<String>::new(), "{none}");
        }
        let urdf = "<!-- x --><robot name='r'><link name='a'><visual><geometry><sphere radius='9'/></geometry></visual>\
                    <collision><geometry><sphere radius='2'/></geometry></collision>\
                    <collision><geometry><box size='1 1 1'/></geometry></collision></link><link name='b'/></robot>";
        assert_eq!(load("x.urdf", urdf).unwrap().notes, ["1 element was skipped: not a sphere"]);
        let mjcf = "<mujoco><worldbody><geom type='plane' size='1 1 1'/><body name='a'><body name='b'>\
                    <geom type='sphere' size='3 0 0'/></body></body></worldbody></mujoco>";
        // The type and the size of a class, of the class around it, and of the class of a body.
        let classes = "<mujoco><default><geom size='2'/><default class='c'><geom type='capsule'/>\
                       <default class='s'><geom type='sphere'/></default></default></default><worldbody>\
                       <geom/><geom class='s' pos='1 0 0'/><geom class='c'/><geom type='sphere' size='3'/>\
                       </worldbody></mujoco>";
        let childclass = "<mujoco><default><default class='c'><geom type='box' size='5'/></default></default>\
                          <worldbody><body childclass='c'><geom/><body><geom/><geom type='sphere'/></body></body>\
                          </worldbody></mujoco>";
        let visual = "<mujoco><default><default class='visual'><geom contype='0' conaffinity='0'/></default></default>\
                      <worldbody><geom class='visual' size='4'/><geom class='visual' contype='1' size='5'/>\
                      <geom contype='0' size='6'/></worldbody></mujoco>";
        let two = "collision: {geometry: b}\ngeometry:\n  a: {spheres: {l: [{center: [0, 0, 0], radius: 1}]}}\n  \
                   b: {spheres: {l: [{center: [0, 0, 0], radius: 2}]}}\n";
        for (name, text, expected) in [
            ("x.xml", classes, &[2.0, 2.0, 3.0][..]),
            ("x.xml", childclass, &[5.0]),
            ("x.xml", visual, &[5.0, 6.0]),
            ("x.xrdf", two, &[2.0]),
            ("x.json", "\u{feff}[{\"center\": [0, 0, 0], \"radius\": 1}]", &[1.0]),
            ("x.yaml", "\u{feff}a: [{center: [0, 0, 0], radius: 1}]", &[1.0]),
            ("x.urdf", &format!("\u{feff}{urdf}"), &[2.0]),
            ("x.csv", "x;y;z;r;note\n1;2;3;4;a, b\n", &[4.0]),
            ("x.csv", "Z,radius,id,y,X\n1,2,7,3,4\n", &[2.0]),
            ("x.csv", "x,y,z,r,g,b,radius\n0,0,0,255,1,1,4\n", &[4.0]),
            ("x.csv", "# radius,x,y,z\n1,10,20,30\n", &[1.0]),
            ("x.csv", "# radius,x,y,z\n# units: m\n1,10,20,30\n", &[1.0]),
            ("x.csv", "# by a tool\n0,0,0,2\n", &[2.0]),
            ("x.xyzr", "# columns: r x y z\n1 10 20 30\n", &[1.0]),
            ("x.txt", "# the columns r[mm] x[mm] y[mm] z[mm]\n1 10 20 30\n", &[1.0]),
            ("x.json", "{\"tip\": {\"center\": [0, 0, 0], \"radius\": 2}, \"n\": 3}", &[2.0]),
            ("x.csv", "0, 0, 0, 1\r\n0, 0, 1, 2\r\n", &[1.0, 2.0]),
            ("x.csv", "\u{feff}\"x\";\"y\";\"z\";\"r\"\n0;0;0;1\n", &[1.0]),
            ("x.txt", "# clump\n0 0 0 1\n0 0 1 2\n", &[1.0, 2.0]),
            ("x.xyzr", "x y z r\n0 0 0 1\n", &[1.0]),
            ("x.xyzr", "2\n0 0 0 1\n1 0 0 2\n", &[1.0, 2.0]),
            ("x.txt", "1 0 0 0\nv 0 0 0 3\n", &[3.0]),
            ("x.json", "[{\"origin\": [0, 0, 0], \"radius\": 1}]", &[1.0]),
            (
                "x.json",
                "[{\"center\": [0, 0, 0], \"radius\": 1, \"id\": 3, \"rgb\": [1, 0, 0], \"on\": true}]",
                &[1.0],
            ),
            (
                "x.json",
                "[{\"center\": [0, 0, 0], \"radius\": 0.3333, \"r\": 0.3333, \"diameter\": 0.667}]",
                &[0.3333],
            ),
            (
                "x.json",
                "[{\"kind\": \"Sphere\", \"center\": [0, 0, 0], \"radius\": 1, \"scale\": 1}]",
                &[1.0],
            ),
            (
                "x.json",
                "[{\"center\": [0, 0, 0], \"radius\": 3}, {\"center\": [0, 0, 0], \"size\": [1, 1, 1]}]",
                &[3.0],
            ),
            ("x.json", "{\"link\": [{\"center\": [0, 0, 0], \"radius\": 2}], \"n\": 3}", &[2.0]),
            ("x.urdf", urdf, &[2.0]),
            ("x.xml", urdf, &[2.0]),
            ("x.xml", mjcf, &[3.0]),
        ] {
            assert_eq!(radii(name, text), expected, "{text}");
        }
    }

    /// In quadratic time this takes a minute.
    #[test]
    fn many_spheres_of_a_robot_are_read_in_linear_time() {
        let collision = "<collision><geometry><sphere radius='1'/></geometry></collision>\n";
        let urdf = format!("<robot><link>\n{}</link></robot>", collision.repeat(40_000));
        assert_eq!(radii("x.urdf", &urdf).len(), 40_000);
        let geoms = "<geom size='1'/>\n".repeat(40_000);
        let mjcf = format!("<mujoco><worldbody>\n{geoms}</worldbody></mujoco>");
        assert_eq!(radii("x.xml", &mjcf).len(), 40_000);
    }

    /// The parser compares the attributes of an element, and the namespaces in scope, in pairs.
    #[test]
    fn xml_with_too_many_attributes_or_namespaces_is_refused() {
        let many = |count: u32, name: &str| {
            (0..count).map(|k| format!(" {name}{k}='u{k}'")).collect::<String>()
        };
        let links = |count: u32| {
            let ball = "<collision><geometry><sphere radius='1'/></geometry></collision>";
            let link = |k| format!("<link xmlns:q{k}='q{k}'>{ball}</link>\n");
            (0..count).map(link).collect::<String>()
        };
        let attributes = format!("<robot>\n<link/><link{}></link></robot>", many(100_000, "a"));
        let namespaces = format!("<robot{}>\n{}</robot>", many(400, "xmlns:n"), links(2_000));
        for (text, expected) in [
            (attributes, "x.urdf, line 2: element \"link\": more than 500 attributes"),
            (
                namespaces,
                "x.urdf, line 102: element \"link\": more than 500 namespace declarations",
            ),
            (
                format!("<robot>\n{}</robot>", links(501)),
                "x.urdf, line 502: element \"link\": more than 500 namespace declarations",
            ),
        ] {
            assert_eq!(load("x.urdf", &text).unwrap_err().to_string(), expected);
        }
        // Comments, character data and values have none.
        let text = many(2_000, "xmlns:n");
        let quoted = format!("<!-- <a{text}> --><robot{}>", many(400, "a"));
        let whole = format!("{quoted}<![CDATA[<a{text}>]]><?p <a{text}>?>{}</robot>", links(1));
        assert_eq!(radii("x.urdf", &whole), [1.0]);
    }

    /// In quadratic time this takes minutes.
    #[test]
    fn wide_rows_below_a_long_comment_are_read_in_linear_time() {
        for (extension, separator) in [("csv", ","), ("txt", " "), ("xyzr", " ")] {
            let [row, words] = [("1", 200_000), ("w", 400_000)]
                .map(|(word, count)| vec![word; count].join(separator));
            assert!(load(&format!("x.{extension}"), &format!("# {words}\n{row}\n")).is_err());
        }
    }

    #[test]
    fn one_of_several_links_is_chosen() {
        let item = "[{center: [0, 0, 0], radius: 1}]";
        let text = format!(
            "geometry:\n  g:\n    spheres:\n      arm: {item}\n      none: []\n      hand: {item}\n"
        );
        let error = load("x.xrdf", &text).unwrap_err().to_string();
        assert_eq!(error, "x.xrdf: 2 links (1 arm, 2 hand); select one by --block K");
        let block = |k| {
            let options = ReadOptions { block: Some(k), ..ReadOptions::default() };
            read_content("x.xrdf", text.as_bytes(), options)
        };
        assert_eq!(block(2).unwrap().mesh.spheres.len(), 1);
        let error = block(3).unwrap_err().to_string();
        assert_eq!(error, "x.xrdf: there is no block 3: the file holds 2, counted from 1");
    }

    /// Names and words of a file of any length and with any character.
    #[test]
    fn messages_repeat_little_of_a_file() {
        let long = format!("\u{1b}[2J{}", "secret`\"".repeat(10_000));
        let json = |value: Value| value.to_string();
        let ball = serde_json::json!([{ "center": [0, 0, 0], "radius": 1 }]);
        let bad = serde_json::json!([{ "center": [0, 0, 0], "radius": long }]);
        let two = Map::from_iter([(long.clone(), ball.clone()), ("b".into(), ball)]);
        let escaped = long.replace('"', "&quot;").replace('\u{1b}', "?");
        for (name, text) in [
            ("x.json", json(two.into())),
            ("x.json", json(Map::from_iter([(long.clone(), bad)]).into())),
            ("x.json", format!("{{{0}: 1, {0}: 2}}", json(long.clone().into()))),
            ("x.yaml", format!("{0}: 1\n{0}: 2\n", json(long.clone().into()))),
            ("x.csv", format!("{long}\n")),
            ("x.csv", format!("x,y,z,r\n0,0,0,{long}\n")),
            ("x.txt", format!("1 0 0 {long}\n")),
            ("x.ma", format!("1 0 0\nv 0 0 0 {long}\n")),
            ("x.ma", format!("1 0 0\nv 0 0 0 1 {long}\n")),
            ("x.ma", format!("2 1 0\nv 0 0 0 1\nv 0 0 0 1\ne 0 {long}\n")),
            ("x.ma", format!("1 0 0\n{long}\n")),
            ("x.obj", format!("{long}\n")),
            ("x.ply", format!("ply\nformat ascii 1.0\n{long}\nend_header\n")),
            ("x.urdf", format!("<robot name=\"{escaped}\"><link></robot>")),
            ("x.urdf", format!("<{}/>", "r".repeat(10_000))),
        ] {
            let error = load(name, &text).map(|loaded| loaded.mesh).unwrap_err().to_string();
            assert!(
                error.len() < 400 && !error.contains(char::is_control),
                "{name}: {error:.2000}"
            );
            assert!(error.matches("secret").count() <= 10, "{error}");
        }
    }

    /// Name, text with `\n` at the end of each line, and the beginning of the error after the name.
    const ERRORS: &str = r#"x.csv =>  => : no spheres
x.csv => x,y,z,r\n => : no spheres
x.csv => x,y,z\n0,0,0\n => , line 1: no column r (found "x,y,z"
x.csv => x,y,z,r\n0,0,0\n => , line 2: 3 fields instead of 4 (found "0,0,0")
x.csv => x,y,z,r\n0,0,0,\n => , line 2: the r "" is not a finite number
x.csv => x,y,z,r\n\n0,0,nan,1\n => , line 3: the z "nan" is not a finite number
x.csv => 0,0,,1\n => , line 1: the z "" is not a finite number
x.csv => 0,0,0,1,5\n => , line 1: 5 fields instead of 4
x.csv => x;y;z;r\n1,5;2,5;3,5;1,25\n => , line 2: the x "1,5" is not a finite number; write
x.csv => x;y;z;r\n1;2;3;1,25\n => , line 2: the r "1,25" is not a finite number; write
x.csv => 0;0;0;1\n0;0;0;1,5\n => , line 2: the r "1,5" is not
x.csv => x,y,z,r\n1,5,2,5,3,5,1,25\n => , line 2: 8 fields instead of 4
x.csv => x,y,z,r\n1,500,2,3,4\n => , line 2: 5 fields instead of 4
x.csv => x,y,z,r\n"1,500",2,3,4\n => , line 2: 5 fields instead of 4
x.csv => 0,0,0,1\n1,000,0,0,1\n => , line 2: 5 fields instead of 4
x.csv => x;y;z;r\n1,2,3,4\n => , line 2: 1 fields instead of 4
x.csv => x,y,z,r\n1;2;3;4\n => , line 2: 1 fields instead of 4
x.csv => x;y;z;r\n1 500;2;3;4\n => , line 2: the x "1 500" is not
x.txt => x y z r\n1,5 2,5 3,5 1,25\n => , line 1: expected three counts
x.xyzr => 0 0 0 1\n0 0 0 1\n1 000 0 0 1\n => , line 3: 5 fields instead of 4
x.xyzr => 0 0 0 1\n0 0 1 inf\n => , line 2: the r "inf" is not
x.csv => x,y,z,r,g,b\n0,0,0,255,1,1\n => , line 1: no column r (found "x,y,z,r,g,b"
x.csv => x,y,z,r,green,blue\n0,0,0,255,1,1\n => , line 1: no column r (found "x,y,z,r,green,blue"
x.ply => ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nproperty uchar r\nproperty uchar green\nproperty uchar blue\nend_header\n0 0 0 255 1 1\n => : element vertex has no property radius
x.ply => ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float x\nproperty float y\nend_header\n0 7 0\n => : line 5: expected properties of different names, found "x"
x.ply => ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nelement vertex 1\nproperty float x\nend_header\n0\n0\n => : line 5: expected elements of different names, found "vertex"
x.csv => x,y,z,r,radius\n0,0,0,5,1\n => , line 1: two columns of radii, r and radius
x.csv => x,y,z,r,x\n0,0,0,5,1\n => , line 1: two columns x (found
x.csv => # x,y,z,diameter\n0,0,0,5\n => , line 2: no column r (found "x,y,z,diameter"
x.csv => # x [mm], y [mm], z [mm], diameter [mm]\n1,2,3,4\n => , line 2: no column r (found "x,y,z,diameter"
x.xyzr => # x y z d (mm)\n0 0 0 1\n0 0 1 1\n => , line 2: no column r (found "x,y,z,d"
x.xyzr => # x y z diameter [m]\n0 0 0 1\n => , line 2: no column r (found "x,y,z,diameter"
x.txt => # 16 spheres: x y z diameter\n0 0 0 1\n => , line 2: no column r (found "x,y,z,diameter"
x.txt => # 16 spheres, (x y z d) of each\n0 0 0 1\n => , line 2: no column r (found "x,y,z,d"
x.csv => # center and diameter\n0,0,0,1\n => , line 2: unclear columns in a comment (found "center and diameter"
x.csv => # x,y,z,diameter\n# by a tool\n0,0,0,5\n => , line 3: no column r
x.xyzr => # r x y z\n2\n1 10 20 30\n2 3 4 5\n => : a comment names other columns
x.json => [{"center": [0, 0, 0], "radius": 1, "child": {"center": [0, 0, 0], "radius": 1}}] => : 2 links (
x.json => {"a": {"center": [0, 0, 0], "r": 1}} => : a: the radius is missing
x.json =>  => , line 1: EOF
x.json => {"a": [{"center": [0, 0, 0], "radius": 1}], "b": [{"position": [0, 0, 0], "radius": 1}]} => : b, sphere 1: none of the names of a center
x.json => [{"center": [0, 0, 0], "radius": 1, "children": [{"center": [0, 0, 0], "radius": 1}]}] => : 2 links (
x.json => [{"center": [0, 0, 0], "origin": [1, 0, 0], "radius": 1}] => : sphere 1: two centers
x.json => {"a": {"center": [0, 0, 0], "radius": 1}, "b": {"position": [1, 0, 0], "radius": 1}} => : b: none of the names
x.json => {"a": {"center": [0, 0, 0], "radius": 1}, "b": {"center": [1, 0, 0], "Radius": 1}} => : b: the radius is missing
x.json => [{"type": "cylinder", "center": [0, 0, 0], "radius": 1, "height": 2}] => : no spheres (found 1 other shapes)
x.json => [{"kind": "capsule", "center": [0, 0, 0], "radius": 1}, {"class": "Box", "center": [0, 0, 0], "radius": 1}] => : no spheres (found 2 other shapes)
x.json => [{"center": [0, 0, 0], "radius": 1, "half_length": 2}, {"center": [0, 0, 0], "radius": 1, "axis": [0, 0, 1]}] => : no spheres (found 2 other shapes)
x.yaml => s:\n  - {center: [0, 0, 0], radius: 0,5} => : s, sphere 1: the key "5" is a number; write decimal points
x.json => {\n] => , line 2:
x.json => {"a": []} => : no spheres
x.json => 3 => : no spheres
x.json => {"a": [{"center": [0, 0, 0]}]} => : a, sphere 1: the radius is missing
x.json => {"a": [{"center": [0, 0], "radius": 1}]} => : a, sphere 1: the center [0,0] is not
x.json => {"a": [{"center": [0, 0, "0"], "radius": 1}]} => : a, sphere 1: the z "0" is not
x.json => [{"center": [0, 0, 0], "radius": 1e999}] => , line 1: number out of range
x.json => [{"center": [0, 0, 0], "radius": 1, "r": 2}] => : sphere 1: the radius 1 contradicts the r 2
x.json => [{"center": [0, 0, 0], "radius": 1, "diameter": 1}] => : sphere 1: the radius 1 contradicts the diameter 1
x.json => [{"type": "hemisphere", "center": [0, 0, 0], "radius": 1}] => : no spheres (found 1 other shapes)
x.json => {"a": [],\n"a": []} => , line 2: duplicate key "a"
x.json => {"a": {"b": 1, "b": 1}} => , line 1: duplicate key "b"
x.json => [{"center": [0, 0, 0], "radius": 1, "radius": 2}] => , line 1: duplicate key "radius"
x.yaml => a:\n  - center: [0, 0, 0]\n    radius: .nan\n => : a, sphere 1: the radius ".nan" is not a finite number
x.yaml => a: [\n => , line
x.yaml => a: 1\na: 2\n => , line 2: duplicate mapping key `a` is not allowed here
x.yaml => a: 1\n---\nb: 2\n => , line 3: only single YAML document expected
x.yaml => ~: 1\n => , line 1: null is not allowed here
x.yaml => collision_spheres: spheres/franka.yml\n => : no spheres
x.xrdf => {collision: {geometry: a}, geometry: {b: {}}} => : collision: no geometry "a"
x.yaml => a:\n  - {center: [0, 0, 0], radius: -1}\n => : no spheres (found 1 with a negative radius)
x.urdf => <robot>\n<link>\n</robot> => , line 3:
x.urdf => <robot><link><collision><geometry><sphere radius='1'/><sphere radius='2'/></geometry></collision></link></robot> => , line 1: several shapes
x.urdf => <robot><link><collision><geometry><sphere radius='0 5'/></geometry></collision></link></robot> => , line 1: the radius "0 5" is not one number
x.xml => <mujoco><worldbody>\n<frame pos='1 0 0'><geom size='1'/></frame></worldbody></mujoco> => , line 2: the element frame is not read; let
x.xml => <mujoco><include file='a.xml'/><worldbody><geom size='1'/></worldbody></mujoco> => , line 1: the element include is not read
x.xml => <mujoco><worldbody><body><composite type='cable' count='9 1 1'/><geom size='1'/></body></worldbody></mujoco> => , line 1: the element composite is not read
x.xml => <mujoco><worldbody><geom class='none' size='1'/></worldbody></mujoco> => , line 1: unknown class "none"
x.urdf => <robot xmlns:xacro="http://www.ros.org/wiki/xacro">\n<xacro:macro name="a"><link/></xacro:macro></robot> => , line 2: macros of xacro are not read
x.urdf => <robot><link><collision><origin xyz='0 0 0'/><origin xyz='1 0 0'/><geometry><sphere radius='1'/></geometry></collision></link></robot> => , line 1: several origins
x.urdf => <sdf/> => : unknown root element (found "sdf", expected robot or mujoco)
x.urdf => <!DOCTYPE r [<!ENTITY a 'b'>]><robot/> => , line 1:
x.urdf => <robot>\n<link><collision><geometry><sphere/></geometry></collision></link></robot> => , line 2: the radius is missing
x.urdf => <robot><link><collision><geometry><mesh/></geometry></collision></link></robot> => : no spheres (found 1 other shapes)
x.xml => <mujoco><worldbody><geom type='sphere' size='1' pos='0 0'/></worldbody></mujoco> => , line 1: the position "0 0" is not three numbers
x.xml => <mujoco><worldbody><geom mesh='m'/><geom fromto='0 0 0 0 0 1' size='1'/></worldbody></mujoco> => : no spheres (found 2 other shapes)
x.xml => <mujoco><default><geom type='box'/></default><worldbody><geom size='1'/></worldbody></mujoco> => : no spheres (found 1 other shapes)
x.xml => <mujoco><worldbody>\n<geom/></worldbody></mujoco> => , line 2: the radius is missing"#;

    #[test]
    fn faults_are_errors_with_their_place() {
        let deep_json = "[".repeat(100_000);
        let deep_yaml = "- ".repeat(100_000);
        let deep_xml = format!("<robot>{}", "<link>".repeat(200_000));
        let bomb = "a: &a [x, x, x, x, x, x, x, x, x]\nb: &b [*a, *a, *a, *a, *a, *a, *a, *a, *a]\n\
                    c: &c [*b, *b, *b, *b, *b, *b, *b, *b, *b]\nd: &d [*c, *c, *c, *c, *c, *c, *c, *c, *c]\n\
                    e: &e [*d, *d, *d, *d, *d, *d, *d, *d, *d]\nf: &f [*e, *e, *e, *e, *e, *e, *e, *e, *e]\n\
                    g: &g [*f, *f, *f, *f, *f, *f, *f, *f, *f]\nh: [*g, *g, *g, *g, *g, *g, *g, *g, *g]\n";
        let check = |name: &str, text: &str, expected: &str| {
            let error = load(name, text).map(|loaded| loaded.mesh).unwrap_err().to_string();
            assert!(
                error.starts_with(&format!("{name}{expected}")),
                "{name} {:.60}: {error}",
                text
            );
            assert!(error.lines().count() == 1 && error.len() < 400, "{error}");
        };
        // Decimal commas and separators of thousands are errors, too.
        for case in ERRORS.lines() {
            let case = case.replace("\\n", "\n");
            let [name, text, expected] = case.splitn(3, " => ").collect::<Vec<_>>()[..] else {
                panic!("{case}");
            };
            check(name, text, expected);
        }
        for (name, text, expected) in [
            ("x.json", &*deep_json, ", line 1: recursion limit"),
            ("x.yaml", &deep_yaml, ", line 1: YAML document too large or too complex"),
            ("x.yaml", bomb, ", line 3: YAML document too large or too complex"),
            ("x.xml", &deep_xml, ""),
        ] {
            check(name, text, expected);
        }
        assert!(read_content("x.urdf", b"\xff", ReadOptions::default()).is_err());
        assert!(read_content("x.yaml", b"\xff", ReadOptions::default()).is_err());
    }
}
