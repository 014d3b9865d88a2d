//! `medial render MESH [AXIS.ma ...] -o x.png`: pictures of a surface and of its medial meshes.

use std::path::{Path, PathBuf};

use clap::{Args, FromArgMatches, ValueEnum};
use medial::Vec3;
use medial::complex::{ContourError, MedialMesh, union_surface};
use medial::metrics::JudgeOptions;
use medial::shape::{Cost, Shape, ShapeOptions};
use medial::surface::{SignedDistance, TriMesh};
use medial_reports::render::{
    Background, Bar, Camera, ColourBy, Errors, Frame, Layer, Panel, Picture, RenderError, Scale,
    Scene, Strip, painted, strip,
};
use medial_reports::significant;
use serde_json::json;

use crate::args::{Global, MeshArgument, fraction, larger_tolerance};
use crate::exit::{Exit, Failure};
use crate::files::{self, check_extension, check_folder, shape_of};
use crate::output::{counted, print_result};
use crate::progress::StageLine;
use crate::study::external::{AxisOptions, read_axis};

/// The usual distance of a reconstruction to the boundary of the union, a fraction of the diagonal.
const TOLERANCE: f64 = 0.02;

/// Arguments of `render`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface file (OFF, OBJ, PLY, STL), `builtin:ID[:RESOLUTION]` or `dataset:NAME`.
    mesh: MeshArgument,
    /// Medial meshes (.ma or .ply with radii). Several give a strip with one panel for each.
    axes: Vec<PathBuf>,
    /// Write the picture (.png).
    #[arg(short, long)]
    output: PathBuf,
    /// Draw this [default: `axis`, or `surface` without a medial mesh].
    #[arg(long, value_enum)]
    show: Option<Show>,
    /// Colour medial meshes by this.
    #[arg(long, alias = "colour", value_enum, default_value_t = Colour::Radius)]
    color: Colour,
    /// Look from `front`, `back`, `left`, `right`, `top`, `bottom`, `iso`, AZIMUTH,ELEVATION in degrees, or direction
    /// X,Y,Z [default: the direction that shows most of the shape].
    #[arg(long, value_name = "VIEW", allow_hyphen_values = true, value_parser = view)]
    camera: Option<View>,
    /// Set the upward direction: `x`, `y`, `z`, `-x`, `-y`, `-z` or X,Y,Z [default: `y`, or `z` for shapes that are flat
    /// along `y`].
    #[arg(long, value_name = "DIRECTION", allow_hyphen_values = true, value_parser = upwards)]
    up: Option<Vec3>,
    /// Enlarge the shape by this factor; 1 fills the picture.
    #[arg(long, default_value_t = 1.0)]
    zoom: f64,
    /// Set the pixels of each panel.
    #[arg(long, value_name = "WxH", default_value = "800x600", value_parser = size)]
    size: [usize; 2],
    /// Set the background: `white`, `black`, `transparent` or `#rrggbb`.
    #[arg(long, value_name = "COLOUR", default_value = "white", value_parser = background)]
    background: Background,
    /// End the colour scale of errors here, as a fraction of the diagonal [default: covers 90 % of the errors, of several
    /// medial meshes those of the better half].
    #[arg(long, value_name = "FRACTION", value_parser = fraction)]
    max_error: Option<f64>,
    /// Limit the distance of a reconstruction to the boundary of the union, as a fraction of the diagonal.
    #[arg(long, value_name = "FRACTION", default_value_t = TOLERANCE, value_parser = fraction)]
    tolerance: f64,
    #[command(flatten)]
    fitting: AxisOptions,
}

/// The content of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Show {
    /// The surface.
    Surface,
    /// The medial mesh, with the surface as glass around it.
    Axis,
    /// The boundary of the union of the spheres, cones and slabs.
    Reconstruction,
    /// The reconstruction coloured by its distance to the surface: red outside, blue inside, glass where parts are
    /// missing. Several medial meshes are drawn above their reconstructions.
    Error,
    /// The sheets of the medial mesh in colours of their own, seams and curves black, within the surface as glass.
    Structure,
}

/// The quantity behind the colours of a medial mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Colour {
    /// The radii of the spheres.
    Radius,
    /// One colour for sheets, one for curves.
    Plain,
}

impl From<Colour> for ColourBy {
    fn from(colour: Colour) -> Self {
        match colour {
            Colour::Radius => Self::Radius,
            Colour::Plain => Self::Plain,
        }
    }
}

/// Runs the verb.
///
/// # Errors
/// When an input is refused, an option is invalid, or the picture cannot be written.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    // All options are checked before the first file is read.
    check_extension(&arguments.output, &["png"])?;
    check_folder(&arguments.output)?;
    let show = show(arguments)?;
    let line = StageLine::new(global.stages());
    line.at("reading");
    let mut read = Read::new(arguments)?;
    read.show(show);
    let Drawn { png, object, text } = drawn(arguments, show, &read, &|stage| line.at(stage))?;
    files::write(&arguments.output, &png)?;
    drop(line);
    Ok(print_result(global, &object, &text, &read.warnings))
}

/// A picture of a shape and of medial meshes in its normalised units, as PNG, with the figures that the verb prints as
/// JSON. `words` are options of the verb; names are captions.
///
/// # Errors
/// When an option is invalid, or a reconstruction fails.
pub fn draw(
    words: Vec<String>,
    shape: Shape,
    axes: Vec<(String, MedialMesh)>,
    at: &dyn Fn(&'static str),
) -> Result<(Vec<u8>, serde_json::Value), Failure> {
    let command = Arguments::augment_args(clap::Command::new("render").no_binary_name(true));
    // Neither is read or written: the parser requires both.
    let fixed = ["mesh.off", "--output", "picture.png"].map(str::to_owned);
    let parsed = command.try_get_matches_from(fixed.into_iter().chain(words));
    let mut arguments = parsed
        .and_then(|found| Arguments::from_arg_matches(&found))
        .map_err(|error| Failure::usage(first_line(&error.to_string())))?;
    let (names, axes): (Vec<_>, Vec<_>) = axes.into_iter().unzip();
    arguments.axes = names.iter().map(PathBuf::from).collect();
    let show = show(&arguments)?;
    let mut read = Read { shape, names, axes, painted: vec![], warnings: vec![] };
    read.show(show);
    let drawn = drawn(&arguments, show, &read, at)?;
    Ok((drawn.png, drawn.object))
}

/// The sentence of a message of the parser, without the usage after it.
fn first_line(text: &str) -> String {
    text.lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned()
}

/// A picture and the figures about it.
struct Drawn {
    png: Vec<u8>,
    object: serde_json::Value,
    text: String,
}

/// Draws the inputs.
fn drawn(
    arguments: &Arguments,
    show: Show,
    read: &Read,
    at: &dyn Fn(&'static str),
) -> Result<Drawn, Failure> {
    let camera = camera(arguments, read.shape.mesh());
    at("making the reconstructions");
    let mut deviations = vec![];
    if matches!(show, Show::Error | Show::Reconstruction) {
        // As in `evaluate` by default: the drawn vertices are fewer and would give another number.
        let judge = (show == Show::Error).then(|| read.shape.judge(None, JudgeOptions::default()));
        let judge = judge.transpose().map_err(|error| Failure::at(&arguments.mesh, error))?;
        for (path, axis) in arguments.axes.iter().zip(&read.axes) {
            let mut made = Deviation::new(&read.shape, path, axis, arguments.tolerance)?;
            let measured = judge.as_ref().map(|judge| judge.distances(axis)).transpose();
            let measured = measured.map_err(|error| Failure::at(path, error))?;
            made.hausdorff = measured.map(|distances| distances.hausdorff);
            deviations.push(made);
        }
    }
    at("drawing");
    let (picture, drawing) = Cost::of(|| match read.axes.len() {
        // A single picture has a colour bar, and a strip has one scale for all panels.
        0 | 1 => single(arguments, show, read, camera, deviations.first()),
        _ => side_by_side(arguments, read, camera, &deviations),
    });
    let picture = picture.map_err(usage)?;
    let png = picture.to_png().map_err(Failure::input)?;
    let output = &arguments.output;
    let (width, height) = (picture.width(), picture.height());
    let errors = deviations
        .iter()
        .map(|d| json!({ "max": d.max(), "mean": d.mean(), "hausdorff": d.hausdorff }));
    let object = json!({
        "output": output, "width": width, "height": height,
        "direction": camera.direction.to_array(), "up": camera.up.to_array(),
        "errors": errors.collect::<Vec<_>>(), "seconds": drawing.seconds,
    });
    let mut text = format!("{}: {width} x {height} pixels", output.display());
    for words in deviations.iter().filter_map(Deviation::hausdorff) {
        text = text + "; " + &words;
    }
    Ok(Drawn { png, object, text })
}

/// The content of the picture, which must fit the number of medial meshes.
fn show(arguments: &Arguments) -> Result<Show, Failure> {
    let (show, problem) = match (arguments.show, arguments.axes.len()) {
        (None, 0) => return Ok(Show::Surface),
        (None, _) => return Ok(Show::Axis),
        (Some(show), 0) if show != Show::Surface => {
            (show, ": no medial mesh; name one after the surface")
        }
        (Some(show @ (Show::Surface | Show::Reconstruction)), 2..) => {
            (show, " with several medial meshes: expected axis, structure or error")
        }
        (Some(show), _) => return Ok(show),
    };
    let word = show.to_possible_value().map_or_else(String::new, |v| v.get_name().into());
    Err(Failure::usage(format!("--show {word}{problem}")))
}

/// The inputs, in diagonals of the surface.
struct Read {
    shape: Shape,
    /// Captions of the medial meshes.
    names: Vec<String>,
    axes: Vec<MedialMesh>,
    /// Their sheets, if these are shown.
    painted: Vec<MedialMesh>,
    warnings: Vec<String>,
}

impl Read {
    fn new(arguments: &Arguments) -> Result<Self, Failure> {
        let (input, shape) = shape_of(&arguments.mesh, ShapeOptions::default())?;
        let mut warnings = input.report.warnings;
        let to_normal = *shape.normalisation();
        let mut axes = Vec::new();
        for path in &arguments.axes {
            let (mesh, notes) = read_axis(path, &shape, arguments.fitting)?.0.with_remarks();
            warnings.extend(notes);
            axes.push(mesh.to_normal(&to_normal));
        }
        let stem = |path: &PathBuf| path.file_stem().unwrap_or_default().to_string_lossy().into();
        let names = arguments.axes.iter().map(stem).collect();
        Ok(Self { shape, names, axes, painted: vec![], warnings })
    }

    fn show(&mut self, show: Show) {
        if show == Show::Structure {
            self.painted = self.axes.iter().map(painted).collect();
        }
    }

    fn colour(&self, arguments: &Arguments) -> ColourBy {
        if self.painted.is_empty() { arguments.color.into() } else { ColourBy::Sheets }
    }
}

/// A strip of several medial meshes.
fn side_by_side(
    arguments: &Arguments,
    read: &Read,
    camera: Camera,
    deviations: &[Deviation],
) -> Result<Picture, RenderError> {
    let mut panels = Vec::new();
    for (k, axis) in read.axes.iter().enumerate() {
        let count = counted(axis.spheres.len() as u64, "sphere");
        let caption = format!("{}, {count}", read.names[k]);
        // Panels differ only by file name and count.
        let axis = read.painted.get(k).unwrap_or(axis);
        panels.push(Panel { axis, caption, errors: deviations.get(k).map(Deviation::errors) });
    }
    let common = Strip {
        surface: read.shape.mesh(),
        diagonal: 1.0,
        camera,
        size: arguments.size,
        across: usize::MAX,
        background: arguments.background,
        colour: read.colour(arguments),
        max_error: arguments.max_error,
    };
    strip(&panels, &common)
}

/// A picture of at most one medial mesh, with a bar where colours mean numbers.
fn single(
    arguments: &Arguments,
    show: Show,
    read: &Read,
    camera: Camera,
    made: Option<&Deviation>,
) -> Result<Picture, RenderError> {
    let surface = read.shape.mesh();
    let (layers, bar) = match (show, read.axes.first(), made) {
        (Show::Axis | Show::Structure, Some(mesh), _) => {
            let mesh = read.painted.first().unwrap_or(mesh);
            let (colour, bar) = read.colour(arguments).of(&[mesh], 1.0);
            (vec![Layer::Axis { mesh, colour }, Layer::Glass(surface)], bar)
        }
        (Show::Reconstruction, _, Some(made)) => (vec![Layer::Surface(&made.mesh)], None),
        (Show::Error, _, Some(made)) => {
            let errors = made.errors();
            let end = arguments.max_error.unwrap_or_else(|| Errors::common_scale(&[&errors], 1.0));
            let scale = Scale::errors(end);
            let layer = Layer::Values { mesh: &made.mesh, values: &made.values, scale };
            (vec![layer, Layer::Ghost(surface)], Some(Errors::bar(&[&errors], end, 1.0)))
        }
        _ => (vec![Layer::Surface(surface)], None),
    };
    let Arguments { size, background, .. } = *arguments;
    // A picture as small as an icon has no room for a bar.
    let bar = bar.filter(|_| 2 * Bar::column(size) <= size[0]);
    let column = if bar.is_some() { Bar::column(size) } else { 0 };
    let frame = Frame::fit(&camera, &surface.vertices)?;
    let scene = Scene { layers, size: [size[0] - column, size[1]], background };
    let picture = scene.picture(&frame)?;
    Ok(match bar {
        Some(bar) => bar.beside(&picture, size, background),
        None => picture,
    })
}

fn usage(error: RenderError) -> Failure {
    let option = match error {
        RenderError::Size { .. } => "--size: ",
        RenderError::Direction(_) => "--camera: ",
        RenderError::Up(_) => "--up: ",
        RenderError::Zoom(_) => "--zoom: ",
        RenderError::Empty | RenderError::Values { .. } | RenderError::Png(_) => "",
    };
    Failure::usage(format!("{option}{error}"))
}

/// The boundary of a union, and the signed distances of its vertices from the surface, in its diagonals.
struct Deviation {
    mesh: TriMesh,
    /// Positive outside.
    values: Vec<f64>,
    /// The Hausdorff error of the medial mesh, where it was measured.
    hausdorff: Option<f64>,
}

impl Deviation {
    /// Makes the reconstruction of a medial mesh in diagonals of the surface, and measures it.
    fn new(shape: &Shape, path: &Path, axis: &MedialMesh, tolerance: f64) -> Result<Self, Failure> {
        let path = path.display();
        let mesh = union_surface(axis, tolerance).map_err(|error| match error {
            ContourError::TooFine { tolerance, feasible, .. } => Failure::usage(format!(
                "--tolerance {tolerance} is too fine for {path}; give --tolerance {:.1e}",
                larger_tolerance(tolerance, feasible, TOLERANCE)
            )),
            ContourError::TooThin { feasible, .. } => Failure::usage(format!(
                "--tolerance {tolerance}: every sphere of {path} is too thin; give --tolerance {feasible:.1e} for \
                 the largest"
            )),
            other => Failure::input(format!("{path}: {other}")),
        })?;
        let mesh = mesh.mesh;
        let tree = shape.surface_tree().map_err(Failure::input)?;
        let inside = shape.inside_test();
        let values = SignedDistance::closed(&tree, &inside).batch(&mesh.vertices);
        Ok(Self { mesh, values, hausdorff: None })
    }

    fn max(&self) -> f64 {
        self.values.iter().copied().map(f64::abs).fold(0.0, f64::max)
    }

    fn mean(&self) -> f64 {
        self.values.iter().copied().map(f64::abs).sum::<f64>() / self.values.len().max(1) as f64
    }

    fn errors(&self) -> Errors<'_> {
        let caption = self.hausdorff().unwrap_or_default();
        Errors { mesh: &self.mesh, values: &self.values, caption }
    }

    /// The Hausdorff error in words.
    fn hausdorff(&self) -> Option<String> {
        Some(format!("Hausdorff {} % of the diagonal", significant(100.0 * self.hausdorff?, 3)))
    }
}

/// Named views: azimuth and elevation in degrees.
// Top and bottom are slightly tilted, since the upward direction must not lie along the line of sight.
const VIEWS: [(&str, f64, f64); 7] = [
    ("front", 0.0, 0.0),
    ("right", 90.0, 0.0),
    ("back", 180.0, 0.0),
    ("left", -90.0, 0.0),
    ("top", 0.0, 89.5),
    ("bottom", 0.0, -89.5),
    ("iso", 45.0, 35.264),
];

/// Direction of the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
enum View {
    /// Azimuth and elevation in degrees.
    Angles(f64, f64),
    /// From the shape to the eye.
    Direction(Vec3),
}

/// The camera of the options, or the one that shows most of the surface.
fn camera(arguments: &Arguments, surface: &TriMesh) -> Camera {
    let up = || arguments.up.unwrap_or_else(|| Camera::fitting_up(surface));
    let camera = match (arguments.camera, arguments.up) {
        (None, None) => Camera::fitting(surface),
        (None, Some(up)) => Camera::around(up, 28.0, 20.0),
        (Some(View::Angles(azimuth, elevation)), _) => Camera::around(up(), azimuth, elevation),
        (Some(View::Direction(direction)), _) => Camera::new(direction, up()),
    };
    Camera { zoom: arguments.zoom, ..camera }
}

fn view(text: &str) -> Result<View, String> {
    let lower = text.to_ascii_lowercase();
    if let Some(&(_, azimuth, elevation)) = VIEWS.iter().find(|view| view.0 == lower) {
        return Ok(View::Angles(azimuth, elevation));
    }
    match numbers(text).as_deref() {
        Some(&[azimuth, elevation]) if elevation.abs() < 90.0 => {
            Ok(View::Angles(azimuth, elevation))
        }
        Some(&[x, y, z]) => Ok(View::Direction(Vec3::new(x, y, z))),
        _ => Err(format!(
            "expected one of {}, or AZIMUTH,ELEVATION in degrees with an elevation between -90 and 90, \
             or a direction X,Y,Z from the shape to the eye",
            VIEWS.map(|view| view.0).join(", ")
        )),
    }
}

/// Numbers between commas, if all are finite.
fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split(',').map(|word| word.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect()
}

fn upwards(text: &str) -> Result<Vec3, &'static str> {
    let (sign, axis) = match text.strip_prefix('-') {
        Some(rest) => (-1.0, rest),
        None => (1.0, text.strip_prefix('+').unwrap_or(text)),
    };
    let axis = match axis {
        "x" | "X" => Some(sign * Vec3::X),
        "y" | "Y" => Some(sign * Vec3::Y),
        "z" | "Z" => Some(sign * Vec3::Z),
        _ => match numbers(text).as_deref() {
            Some(&[x, y, z]) => Vec3::new(x, y, z).try_normalize(),
            _ => None,
        },
    };
    axis.ok_or("expected x, y, z, -x, -y, -z or a direction X,Y,Z")
}

/// Width and height from `WxH`.
fn size(text: &str) -> Result<[usize; 2], &'static str> {
    let sides = text.split_once(['x', 'X']).and_then(|(width, height)| {
        Some([width.trim().parse().ok()?, height.trim().parse().ok()?])
    });
    sides.ok_or("expected WIDTHxHEIGHT in pixels, for example 800x600")
}

/// The background by name or code.
fn background(text: &str) -> Result<Background, &'static str> {
    let found = match text {
        "white" => Some(Background::WHITE),
        "black" => Some(Background::Colour([0; 3])),
        "transparent" => Some(Background::Transparent),
        _ => text.strip_prefix('#').and_then(|hex| {
            // The parser also accepts a sign.
            let is_hex = hex.len() == 6 && hex.bytes().all(|b| b.is_ascii_hexdigit());
            let code = is_hex.then(|| u32::from_str_radix(hex, 16).ok()).flatten()?;
            let [_, colour @ ..] = code.to_be_bytes();
            Some(Background::Colour(colour))
        }),
    };
    found.ok_or("expected white, black, transparent or #rrggbb")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_parsed_or_refused() {
        assert_eq!(size("800x600"), Ok([800, 600]));
        assert_eq!(background("#0a0B0c"), Ok(Background::Colour([10, 11, 12])));
        assert_eq!(upwards("-z"), Ok(-Vec3::Z));
        assert_eq!(upwards("0,3,0"), Ok(Vec3::Y));
        assert_eq!(view("right"), Ok(View::Angles(90.0, 0.0)));
        assert_eq!(view("-90,0"), Ok(View::Angles(-90.0, 0.0)));
        assert_eq!(view("1,2,3"), Ok(View::Direction(Vec3::new(1.0, 2.0, 3.0))));
        for text in ["800", "800x", "x600", "-1x5", "800x600x2"] {
            assert!(size(text).is_err(), "{text}");
        }
        for text in ["red", "#12345", "#1234567", "#+1+1+1", "#äöü"] {
            assert!(background(text).is_err(), "{text}");
        }
        for text in ["w", "0,0,0", "1,2", "nan,0,1"] {
            assert!(upwards(text).is_err(), "{text}");
        }
        for text in ["somewhere", "1", "0,90", "1,2,3,4", "inf,0"] {
            assert!(view(text).is_err(), "{text}");
        }
    }
}
