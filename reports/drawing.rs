//! A picture of a surface and of medial meshes of it: the work of `render`, for the command and for Python.

use std::str::FromStr;

use medial::Vec3;
use medial::complex::{MedialMesh, union_surface};
use medial::metrics::JudgeOptions;
use medial::shape::{Cost, Shape};
use medial::surface::{SignedDistance, TriMesh};
use medial_run::error::InputError;
use medial_run::reconstruct::contour_error;
use medial_run::text::{counted, significant};
use serde::{Deserialize, Serialize};

use crate::render::{
    Bar, Camera, Errors, Frame, Layer, Panel, PanelRow, Picture, RenderError, Scale, Strip, draw,
    painted, strip,
};

pub use crate::render::{Background, ColourBy};

/// Largest distance of a drawn reconstruction from the boundary of the union by default, a fraction of the diagonal.
pub const TOLERANCE: f64 = 0.02;

/// The content of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Show {
    /// The surface.
    Surface,
    /// The medial mesh, with the surface as glass around it.
    Axis,
    /// The boundary of the union of the spheres, cones and slabs.
    Reconstruction,
    /// The reconstruction coloured by its distance to the surface: red outside, blue inside, glass where parts are
    /// missing. Several medial meshes are drawn above their reconstructions.
    Error,
    /// The sheets of the medial mesh in separate colours, seams and curves black, within the surface as glass.
    Structure,
}

/// The options of a picture.
#[derive(Clone, Copy, Debug)]
pub struct Drawing {
    /// The content; `None` for `axis`, or `surface` without a medial mesh.
    pub show: Option<Show>,
    /// The quantity behind the colours of a medial mesh.
    pub colour: ColourBy,
    /// Direction of the camera; `None` for the one that shows most of the surface.
    pub camera: Option<View>,
    /// Upward direction; `None` for `y`, or `z` for shapes that are flat along `y`.
    pub up: Option<Upward>,
    /// Width and height of each panel in pixels.
    pub size: [usize; 2],
    /// The background.
    pub background: Background,
    /// End of the scale of errors, a fraction of the diagonal; `None` covers 90 % of the errors.
    pub max_error: Option<f64>,
    /// Largest distance of a reconstruction from the boundary of the union, a fraction of the diagonal.
    pub tolerance: f64,
}

/// A picture and the figures about it.
pub struct Drawn {
    /// The content of a PNG file.
    pub png: Vec<u8>,
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// From the shape to the eye.
    pub direction: Vec3,
    /// Upward direction.
    pub up: Vec3,
    /// Errors of each drawn reconstruction.
    pub errors: Vec<DrawnError>,
    /// Wall-clock seconds of the drawing.
    pub seconds: f64,
}

/// Errors of a drawn reconstruction, as fractions of the diagonal.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct DrawnError {
    /// Largest distance of its vertices from the surface.
    pub max: f64,
    /// Mean distance of its vertices from the surface.
    pub mean: f64,
    /// The Hausdorff error of the medial mesh, as in `evaluate`, where it was measured.
    pub hausdorff: Option<f64>,
}

/// The reason for which there is no picture.
#[derive(Debug, thiserror::Error)]
#[error("{}{error}", axis.as_ref().map_or_else(String::new, |name| format!("{name}: ")))]
pub struct DrawError {
    /// The medial mesh that it is about.
    pub axis: Option<String>,
    /// Its message begins with the name of a wrong option.
    pub error: InputError,
}

impl From<InputError> for DrawError {
    fn from(error: InputError) -> Self {
        Self { axis: None, error }
    }
}

impl Drawing {
    /// The content of a picture of some medial meshes.
    ///
    /// # Errors
    /// For a content that requires another number of medial meshes.
    pub fn content(&self, count: usize) -> Result<Show, InputError> {
        let (show, problem) = match (self.show, count) {
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
        let word = serde_json::to_value(show).unwrap_or_default();
        Err(InputError::option(format!("show {}{problem}", word.as_str().unwrap_or_default())))
    }

    /// A picture of a shape and of named medial meshes in its normalised units. `at` gets each stage.
    ///
    /// # Errors
    /// When an option is wrong, or a reconstruction fails.
    pub fn draw(
        &self,
        shape: &Shape,
        axes: &[(String, MedialMesh)],
        at: &dyn Fn(&'static str),
    ) -> Result<Drawn, DrawError> {
        let fractions = [("tolerance", Some(self.tolerance)), ("max_error", self.max_error)];
        for (option, value) in fractions {
            if let Some(value) = value.filter(|&x| !(x > 0.0 && x <= 1.0)) {
                let problem = format!("{option} {value}: expected a number above 0 and at most 1");
                return Err(InputError::option(problem).into());
            }
        }
        let show = self.content(axes.len())?;
        let painted = match show {
            Show::Structure => axes.iter().map(|(_, axis)| painted(axis)).collect(),
            _ => vec![],
        };
        let camera = self.camera(shape.mesh());
        at("making the reconstructions");
        let mut deviations = vec![];
        if matches!(show, Show::Error | Show::Reconstruction) {
            // As in `evaluate` by default: the drawn vertices are fewer and would give another number.
            let judge = (show == Show::Error).then(|| shape.judge(None, JudgeOptions::default()));
            let judge = judge.transpose().map_err(InputError::input)?;
            for (name, axis) in axes {
                let mut made = Deviation::new(shape, name, axis, self.tolerance)?;
                let measured = judge.as_ref().map(|judge| judge.distances(axis)).transpose();
                let measured = measured.map_err(|error| DrawError {
                    axis: Some(name.clone()),
                    error: InputError::input(error),
                });
                made.hausdorff = measured?.map(|distances| distances.hausdorff);
                deviations.push(made);
            }
        }
        at("drawing");
        let scene = Content { drawing: self, show, shape, axes, painted: &painted, camera };
        let (picture, cost) = Cost::of(|| match axes.len() {
            // A single picture has a colour bar, and a strip has one scale for all panels.
            0 | 1 => scene.single(deviations.first()),
            _ => scene.side_by_side(&deviations),
        });
        let picture = picture.map_err(InputError::option)?;
        let errors = deviations.iter().map(Deviation::figures).collect();
        let Picture { width, height, .. } = picture;
        let Camera { direction, up, .. } = camera;
        let png = picture.to_png().map_err(InputError::input)?;
        Ok(Drawn { png, width, height, direction, up, errors, seconds: cost.seconds })
    }

    /// The camera of the options, or the one that shows most of the surface.
    fn camera(&self, surface: &TriMesh) -> Camera {
        let up = || self.up.map_or_else(|| Camera::fitting_up(surface), |up| up.0);
        match (self.camera, self.up) {
            (None, None) => Camera::fitting(surface),
            (None, Some(up)) => Camera::around(up.0, 28.0, 20.0),
            (Some(View::Angles(azimuth, elevation)), _) => Camera::around(up(), azimuth, elevation),
            (Some(View::Direction(direction)), _) => Camera::new(direction, up()),
        }
    }
}

/// The content of one picture.
struct Content<'a> {
    drawing: &'a Drawing,
    show: Show,
    shape: &'a Shape,
    axes: &'a [(String, MedialMesh)],
    /// Sheets of the medial meshes, where these are shown.
    painted: &'a [MedialMesh],
    camera: Camera,
}

impl Content<'_> {
    fn colour(&self) -> ColourBy {
        if self.painted.is_empty() { self.drawing.colour } else { ColourBy::Sheets }
    }

    /// A strip of several medial meshes.
    fn side_by_side(&self, deviations: &[Deviation]) -> Result<Picture, RenderError> {
        let mut panels = Vec::new();
        for (k, (name, axis)) in self.axes.iter().enumerate() {
            let count = counted(axis.spheres.len(), "sphere", "spheres");
            let caption = format!("{name}, {count}");
            // Panels differ only by file name and count.
            let axis = self.painted.get(k).unwrap_or(axis);
            panels.push(Panel { axis, caption, errors: deviations.get(k).map(Deviation::errors) });
        }
        let common = Strip {
            surface: self.shape.mesh(),
            diagonal: 1.0,
            camera: self.camera,
            size: self.drawing.size,
            across: usize::MAX,
            background: self.drawing.background,
            colour: self.colour(),
            max_error: self.drawing.max_error,
        };
        strip(&panels, &common)
    }

    /// A picture of at most one medial mesh, with a bar where colours mean numbers.
    fn single(&self, made: Option<&Deviation>) -> Result<Picture, RenderError> {
        let surface = self.shape.mesh();
        let (layers, bar) = match (self.show, self.axes.first(), made) {
            (Show::Axis | Show::Structure, Some((_, mesh)), _) => {
                let mesh = self.painted.first().unwrap_or(mesh);
                let (colour, bar) = self.colour().of(&[mesh], 1.0);
                (vec![Layer::Axis { mesh, colour }, Layer::Glass(surface)], bar)
            }
            (Show::Reconstruction, _, Some(made)) => (vec![Layer::Surface(&made.mesh)], None),
            (Show::Error, _, Some(made)) => {
                let errors = made.errors();
                let end =
                    self.drawing.max_error.unwrap_or_else(|| Errors::common_scale(&[&errors], 1.0));
                let scale = Scale::errors(end);
                let layer = Layer::Values { mesh: &made.mesh, values: &made.values, scale };
                (vec![layer, Layer::Ghost(surface)], Some(Errors::bar(&[&errors], end, 1.0)))
            }
            _ => (vec![Layer::Surface(surface)], None),
        };
        let Drawing { size, background, .. } = *self.drawing;
        // A picture as small as an icon has no room for a bar.
        let bar = bar.filter(|_| 2 * Bar::column(size) <= size[0]);
        let column = if bar.is_some() { Bar::column(size) } else { 0 };
        let frame = Frame::fit(&self.camera, &surface.vertices)?;
        let row = PanelRow { cells: vec![Some((layers, ""))], bar };
        draw(vec![row], [size[0] - column, size[1]], background, &frame)
    }
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
    fn new(
        shape: &Shape,
        name: &str,
        axis: &MedialMesh,
        tolerance: f64,
    ) -> Result<Self, DrawError> {
        let made = union_surface(axis, tolerance).map_err(|error| DrawError {
            axis: Some(name.to_owned()),
            error: contour_error(error, 1.0, TOLERANCE),
        });
        let mesh = made?.mesh;
        let tree = shape.surface_tree().map_err(InputError::input)?;
        let inside = shape.inside_test();
        let values = SignedDistance::closed(&tree, &inside).batch(&mesh.vertices);
        Ok(Self { mesh, values, hausdorff: None })
    }

    fn figures(&self) -> DrawnError {
        let sizes = || self.values.iter().copied().map(f64::abs);
        let mean = sizes().sum::<f64>() / self.values.len().max(1) as f64;
        DrawnError { max: sizes().fold(0.0, f64::max), mean, hausdorff: self.hausdorff }
    }

    fn errors(&self) -> Errors<'_> {
        let caption = self.hausdorff.map(hausdorff_text).unwrap_or_default();
        Errors { mesh: &self.mesh, values: &self.values, caption }
    }
}

/// A Hausdorff error in words.
pub fn hausdorff_text(error: f64) -> String {
    format!("Hausdorff {} % of the diagonal", significant(100.0 * error, 3))
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
pub enum View {
    /// Azimuth and elevation in degrees.
    Angles(f64, f64),
    /// From the shape to the eye.
    Direction(Vec3),
}

impl FromStr for View {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
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
}

/// Numbers between commas, if all are finite.
fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split(',').map(|word| word.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect()
}

/// The upward direction of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Upward(pub Vec3);

impl FromStr for Upward {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, &'static str> {
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
        axis.map(Self).ok_or("expected x, y, z, -x, -y, -z or a direction X,Y,Z")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_parsed_or_refused() {
        assert_eq!("#0a0B0c".parse(), Ok(Background::Colour([10, 11, 12])));
        assert_eq!("-z".parse(), Ok(Upward(-Vec3::Z)));
        assert_eq!("0,3,0".parse(), Ok(Upward(Vec3::Y)));
        assert_eq!("right".parse(), Ok(View::Angles(90.0, 0.0)));
        assert_eq!("-90,0".parse(), Ok(View::Angles(-90.0, 0.0)));
        assert_eq!("1,2,3".parse(), Ok(View::Direction(Vec3::new(1.0, 2.0, 3.0))));
        for text in ["red", "#12345", "#1234567", "#+1+1+1", "#äöü"] {
            assert!(text.parse::<Background>().is_err(), "{text}");
        }
        for text in ["w", "0,0,0", "1,2", "nan,0,1"] {
            assert!(text.parse::<Upward>().is_err(), "{text}");
        }
        for text in ["somewhere", "1", "0,90", "1,2,3,4", "inf,0"] {
            assert!(text.parse::<View>().is_err(), "{text}");
        }
    }
}
