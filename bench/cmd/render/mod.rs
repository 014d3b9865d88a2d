//! `medial render MESH [AXIS.ma ...] -o x.png`: pictures of a surface and of its medial meshes.

mod errors;
mod words;

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use medial::complex::MedialMesh;
use medial::shape::{Cost, Shape, ShapeOptions};
use medial::write_atomically;
use medial_reports::render::{
    AxisColour, Background, Bar, Camera, ColourBy, Errors, Frame, Layer, Panel, Picture,
    RenderError, Scale, Scene, Strip, strip,
};
use serde_json::json;

use self::errors::Deviation;
use crate::args::{AxisArguments, Global, MeshArgument};
use crate::exit::{Exit, Failure};
use crate::files::{check_extension, check_folder, medial_mesh_for};
use crate::output::{counted, print_json, print_line};
use crate::run::{Input, Source, StageLine, percent};

/// Arguments of `render`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Surface file (OFF, OBJ, PLY, STL, GLB), `builtin:ID[:RESOLUTION]` or `dataset:NAME`.
    mesh: MeshArgument,
    /// Medial meshes of it (.ma, or .ply with radii). Of several, a strip: a panel for each, from
    /// the same camera.
    axes: Vec<PathBuf>,
    /// The picture (.png).
    #[arg(short, long)]
    output: PathBuf,
    /// What is drawn [default: `axis`, `surface` without a medial mesh]. `error` with several medial meshes: both the
    /// medial meshes and, below, their reconstructions.
    #[arg(long, value_enum)]
    show: Option<Show>,
    /// What a medial mesh is coloured by.
    #[arg(long, alias = "colour", value_enum, default_value_t = Colour::Radius)]
    color: Colour,
    /// `front`, `back`, `left`, `right`, `top`, `bottom`, `iso`, AZIMUTH,ELEVATION in degrees, or X,Y,Z from the shape to
    /// the eye [default: what shows most of the shape].
    #[arg(long, value_name = "VIEW", allow_hyphen_values = true)]
    camera: Option<String>,
    /// What is up: `x`, `y`, `z`, `-x`, `-y`, `-z` or X,Y,Z [default: `y`, `z` for what is flat along `y`].
    #[arg(long, value_name = "DIRECTION", allow_hyphen_values = true)]
    up: Option<String>,
    /// 1: the shape fills the picture; 2: twice as large.
    #[arg(long, default_value_t = 1.0)]
    zoom: f64,
    /// Nearer parts larger, as an eye sees them.
    #[arg(long)]
    perspective: bool,
    /// Pixels of the picture, of a strip's panel.
    #[arg(long, value_name = "WxH", default_value = "800x600")]
    size: String,
    /// `white`, `black`, `transparent` or `#rrggbb`.
    #[arg(long, value_name = "COLOUR", default_value = "white")]
    background: String,
    /// So many pictures around the shape: x-000.png, x-001.png, ...
    #[arg(long, value_name = "N")]
    turntable: Option<usize>,
    /// The end of the scale of errors, as a fraction of the diagonal [default: 99 % of the errors are within it].
    #[arg(long, value_name = "FRACTION")]
    max_error: Option<f64>,
    /// How far a reconstruction may be from the boundary of the union, as a fraction of the diagonal.
    #[arg(long, value_name = "FRACTION", default_value_t = 0.01)]
    tolerance: f64,
    #[command(flatten)]
    fitting: AxisArguments,
}

/// What is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Show {
    /// The surface.
    Surface,
    /// The medial mesh, with the surface as glass around it.
    Axis,
    /// The boundary of the union of the spheres, cones and slabs.
    Reconstruction,
    /// The same, coloured by its distance to the surface: red outside, blue inside;
    /// what of the surface it lacks, as glass.
    Error,
}

/// What a medial mesh is coloured by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Colour {
    /// The radii of the spheres.
    Radius,
    /// The stability ratios of the edges.
    Stability,
    /// One colour for sheets, one for curves.
    Plain,
}

impl From<Colour> for ColourBy {
    fn from(colour: Colour) -> Self {
        match colour {
            Colour::Radius => Self::Radius,
            Colour::Stability => Self::Stability,
            Colour::Plain => Self::Plain,
        }
    }
}

/// More pictures than this around a shape are taken for a slip.
const MOST_PICTURES: usize = 3600;

/// Runs the verb.
///
/// # Errors
/// When an input is refused, an option is not understood, or the picture cannot be written.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Exit, Failure> {
    let asked = Asked::new(arguments)?;
    let line = StageLine::new(global.stages());
    line.at("reading");
    let read = Read::new(arguments)?;
    let camera = words::camera(arguments, read.shape.mesh())?;
    line.at("making the reconstructions");
    let deviations = match asked.show {
        Show::Error | Show::Reconstruction => {
            let named = arguments.axes.iter().zip(&read.axes);
            let of = |(path, axis): (&PathBuf, &MedialMesh)| {
                errors::deviation(&read.shape, path, axis, arguments.tolerance)
            };
            named.map(of).collect::<Result<Vec<_>, _>>()?
        }
        Show::Surface | Show::Axis => vec![],
    };
    line.at("drawing");
    let work = Work { arguments, asked: &asked, read: &read, camera, deviations: &deviations };
    let (pictures, drawing) = Cost::of(|| work.pictures());
    let pictures = pictures?;
    let files = files(&arguments.output, arguments.turntable.map(|_| pictures.len()));
    for (file, picture) in files.iter().zip(&pictures) {
        let bytes = picture.to_png().map_err(Failure::input)?;
        write_atomically(file, |out| out.write_all(&bytes))
            .map_err(|error| Failure::input(format!("{}: {error}", file.display())))?;
    }
    drop(line);
    let size = pictures.first().map_or([0, 0], |picture| [picture.width(), picture.height()]);
    if global.json {
        let errors: Vec<_> = deviations
            .iter()
            .map(|deviation| json!({ "max": deviation.max(), "mean": deviation.mean() }))
            .collect();
        let object = json!({
            "output": files, "width": size[0], "height": size[1],
            "direction": camera.direction.to_array(), "up": camera.up.to_array(),
            "errors": errors, "seconds": drawing.seconds,
        });
        print_json(&object, &read.warnings);
        return Ok(Exit::Done);
    }
    for file in &files {
        print_line(&format!("{}: {} x {} pixels", file.display(), size[0], size[1]));
    }
    read.warnings.iter().for_each(|warning| print_line(&format!("  warning: {warning}")));
    Ok(Exit::Done)
}

/// The options, understood before anything is read.
struct Asked {
    show: Show,
    size: [usize; 2],
    background: Background,
}

impl Asked {
    fn new(arguments: &Arguments) -> Result<Self, Failure> {
        check_extension(&arguments.output, &["png"])?;
        check_folder(&arguments.output)?;
        let show = show(arguments)?;
        let positive = |option: &str, value: f64| match value > 0.0 && value <= 1.0 {
            true => Ok(()),
            false => Err(Failure::usage(format!(
                "--{option} {value}: ask for more than 0 and at most 1"
            ))),
        };
        arguments.max_error.map_or(Ok(()), |value| positive("max-error", value))?;
        positive("tolerance", arguments.tolerance)?;
        if let Some(pictures) = arguments.turntable
            && !(1..=MOST_PICTURES).contains(&pictures)
        {
            let message = format!("--turntable {pictures}: ask for 1 to {MOST_PICTURES} pictures");
            return Err(Failure::usage(message));
        }
        let (size, background) =
            (words::size(&arguments.size)?, words::background(&arguments.background)?);
        Ok(Self { show, size, background })
    }
}

/// What is drawn, as far as there are medial meshes for it.
fn show(arguments: &Arguments) -> Result<Show, Failure> {
    let word =
        |show: Show| show.to_possible_value().map_or_else(String::new, |v| v.get_name().into());
    let show = match (arguments.show, arguments.axes.len()) {
        (None, 0) => Show::Surface,
        (None, _) => Show::Axis,
        (Some(show), 0) if show != Show::Surface => {
            let message = format!("--show {}: name a medial mesh after the surface", word(show));
            return Err(Failure::usage(message));
        }
        (Some(show @ (Show::Surface | Show::Reconstruction)), 2..) => {
            let message =
                format!("--show {} with several medial meshes: ask for axis or error", word(show));
            return Err(Failure::usage(message));
        }
        (Some(show), _) => show,
    };
    match (arguments.turntable, arguments.axes.len()) {
        (Some(pictures), 2..) => Err(Failure::usage(format!(
            "--turntable {pictures} with several medial meshes: name one, or leave it out"
        ))),
        _ => Ok(show),
    }
}

/// The inputs, in diagonals of the surface.
struct Read {
    shape: Shape,
    axes: Vec<MedialMesh>,
    warnings: Vec<String>,
}

impl Read {
    fn new(arguments: &Arguments) -> Result<Self, Failure> {
        let source = Source::parse(&arguments.mesh).map_err(Failure::usage)?;
        let input = Input::load(&source)?;
        let mut warnings = input.report.warnings.clone();
        let shape =
            input.shape(ShapeOptions::default()).map_err(|error| Failure::of(&source, error))?;
        let to_normal = *shape.normalisation();
        let mut axes = Vec::new();
        for path in &arguments.axes {
            let (mesh, notes) = medial_mesh_for(path, &shape, &arguments.fitting)?.0.with_remarks();
            warnings.extend(notes);
            axes.push(mesh.transformed(1.0 / to_normal.diagonal, |p| to_normal.forward(p)));
        }
        Ok(Self { shape, axes, warnings })
    }
}

/// All that pictures are made of.
struct Work<'a> {
    arguments: &'a Arguments,
    asked: &'a Asked,
    read: &'a Read,
    camera: Camera,
    deviations: &'a [Deviation],
}

impl Work<'_> {
    fn pictures(&self) -> Result<Vec<Picture>, Failure> {
        if self.read.axes.len() > 1 {
            return Ok(vec![self.strip().map_err(usage)?]);
        }
        let pictures = self.arguments.turntable.unwrap_or(1);
        let turns = (0..pictures).map(|k| 360.0 * k as f64 / pictures as f64);
        let cameras: Vec<Camera> = turns.map(|degrees| self.camera.turned(degrees)).collect();
        let points = &self.read.shape.mesh().vertices;
        let frames = match cameras.as_slice() {
            [camera] => Frame::fit(camera, points).map(|frame| vec![frame]),
            several => Frame::fit_alike(several, points),
        };
        let frames = frames.map_err(usage)?;
        frames.iter().map(|frame| self.single(frame).map_err(usage)).collect()
    }

    fn strip(&self) -> Result<Picture, RenderError> {
        let panel = |(k, axis): (usize, &'_ MedialMesh)| {
            let name = self.arguments.axes[k].file_stem().unwrap_or_default().to_string_lossy();
            format!("{name}, {}", counted(axis.spheres.len() as u64, "sphere"))
        };
        let captions = self.read.axes.iter().enumerate().map(panel);
        let panels: Vec<Panel<'_>> = captions
            .zip(&self.read.axes)
            .enumerate()
            .map(|(k, (caption, axis))| {
                let errors = self.deviations.get(k).map(Deviation::errors);
                Panel { axis, caption, errors }
            })
            .collect();
        let common = Strip {
            surface: self.read.shape.mesh(),
            diagonal: 1.0,
            camera: self.camera,
            size: self.asked.size,
            across: usize::MAX,
            background: self.asked.background,
            colour: self.arguments.color.into(),
            max_error: self.arguments.max_error,
        };
        strip(&panels, &common)
    }

    /// A picture of at most one medial mesh, with a bar where colours mean numbers.
    fn single(&self, frame: &Frame) -> Result<Picture, RenderError> {
        let (layers, bar) = self.layers();
        let [width, height] = self.asked.size;
        // On a picture as small as an icon nothing would be left beside it.
        let bar = bar.filter(|_| 2 * Bar::column(self.asked.size) <= width);
        let column = if bar.is_some() { Bar::column(self.asked.size) } else { 0 };
        let size = [width.saturating_sub(column), height];
        let background = self.asked.background;
        let picture = Scene { layers, size, background }.picture(frame)?;
        Ok(match bar {
            Some(bar) => bar.beside(&picture, self.asked.size, background),
            None => picture,
        })
    }

    fn layers(&self) -> (Vec<Layer<'_>>, Option<Bar>) {
        let surface = self.read.shape.mesh();
        match (self.asked.show, self.read.axes.first(), self.deviations.first()) {
            (Show::Axis, Some(mesh), _) => {
                let by = ColourBy::from(self.arguments.color);
                let (colour, bar): (AxisColour, _) = by.of(&[mesh], 1.0);
                (vec![Layer::Axis { mesh, colour }, Layer::Glass(surface)], bar)
            }
            (Show::Reconstruction, _, Some(made)) => (vec![Layer::Surface(&made.mesh)], None),
            (Show::Error, _, Some(made)) => {
                let errors = made.errors();
                let end = self.arguments.max_error;
                let end = end.unwrap_or_else(|| Errors::common_scale(&[&errors], 1.0));
                let scale = Scale::errors(end);
                let layer = Layer::Values { mesh: &made.mesh, values: &made.values, scale };
                (vec![layer, Layer::Ghost(surface)], Some(Errors::bar(&[&errors], end, 1.0)))
            }
            _ => (vec![Layer::Surface(surface)], None),
        }
    }
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

/// The files of pictures: the one named, or around a shape numbered ones beside it.
fn files(output: &Path, turntable: Option<usize>) -> Vec<PathBuf> {
    let Some(pictures) = turntable else { return vec![output.to_owned()] };
    let stem = output.file_stem().unwrap_or_default().to_string_lossy();
    (0..pictures).map(|k| output.with_file_name(format!("{stem}-{k:03}.png"))).collect()
}

impl Deviation {
    fn errors(&self) -> Errors<'_> {
        let caption = format!("error up to {}, mean {}", percent(self.max()), percent(self.mean()));
        Errors { mesh: &self.mesh, values: &self.values, caption }
    }
}
