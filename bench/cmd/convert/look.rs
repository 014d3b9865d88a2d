//! How a medial mesh is shown in a file for viewers: what it is coloured by, and whether its spheres are bodies.

use std::path::Path;

use clap::{Args, ValueEnum};
use medial::complex::{self, LoadedMa, Look, MedialMesh, SphereValues, single_precision_loss};
use medial::geometry::trees::Bounds;
use medial::shape::{Shape, ShapeOptions};
use medial::surface::SignedDistance;

use crate::args::{AxisArguments, MeshArgument, ReadArguments};
use crate::exit::Failure;
use crate::files::{check_extension, extension, medial_mesh_for};
use crate::run::{Input, Source};

/// Options of formats for viewers.
#[derive(Debug, Args)]
pub struct LookArguments {
    /// What `.glb` is coloured by, and an array beside the radii in `.vtp` [default: radius].
    #[arg(long, alias = "colour", value_enum)]
    color: Option<Colour>,
    /// The surface (a file, or `builtin:ID[:RESOLUTION]`) that errors are measured to, in the units of the medial mesh.
    #[arg(long, value_name = "SURFACE")]
    mesh: Option<MeshArgument>,
    /// The spheres as round bodies as well, in `.glb`: one mesh of 80 triangles and 2.3 kB a sphere.
    #[arg(long)]
    spheres: bool,
}

/// What a medial mesh is coloured by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Colour {
    /// The radii of the spheres.
    Radius,
    /// Of each sphere the least stability ratio of its edges.
    Stability,
    /// By how much each sphere reaches out of the surface of `--mesh` (red) or falls short of it (blue).
    Error,
}

impl LookArguments {
    /// Whether any of the options was given.
    pub fn is_asked(&self) -> bool {
        self.color.is_some() || self.mesh.is_some() || self.spheres
    }

    /// Refuses what the output has no room for, and what lacks something, before anything is read.
    ///
    /// # Errors
    /// When it is so.
    pub fn check(&self, to: &Path) -> Result<(), Failure> {
        let refuse = |option: &str, known: &[&str]| {
            check_extension(to, known)
                .map_err(|Failure { message, .. }| Failure::usage(format!("{option}: {message}")))
        };
        if self.color.is_some() {
            refuse("--color", &["vtp", "glb"])?;
        }
        if self.spheres {
            refuse("--spheres", &["glb"])?;
        }
        match (self.color, &self.mesh) {
            (Some(Colour::Error), None) => {
                Err(Failure::usage("--color error: name the surface with --mesh"))
            }
            (Some(Colour::Error), Some(_)) | (_, None) => Ok(()),
            (_, Some(_)) => Err(Failure::usage("--mesh is for --color error only")),
        }
    }

    /// Reads a medial mesh, and how it is shown.
    ///
    /// # Errors
    /// When it or the surface is refused, or they cannot belong together.
    pub fn read(&self, from: &Path, read: &ReadArguments) -> Result<(LoadedMa, Look), Failure> {
        if let Some(surface) = &self.mesh {
            let fitting = AxisArguments { read: read.clone(), ..AxisArguments::default() };
            let source = Source::parse(surface).map_err(Failure::usage)?;
            let shape = Input::load(&source)?
                .shape(ShapeOptions::default())
                .map_err(|error| Failure::of(&source, error))?;
            let loaded = medial_mesh_for(from, &shape, &fitting)?.0;
            let values = Some(SphereValues::error(errors(&loaded.mesh, &shape)?));
            return Ok((loaded, Look { values, balls: self.spheres }));
        }
        let loaded = complex::read_with(from, read.options()).map_err(Failure::input)?;
        let values = match self.color {
            Some(Colour::Stability) => {
                Some(SphereValues::stability(&loaded.mesh, diagonal(&loaded.mesh)))
            }
            Some(Colour::Radius | Colour::Error) | None => None,
        };
        Ok((loaded, Look { values, balls: self.spheres }))
    }
}

/// Of each sphere its radius less the depth of its centre below the surface, in input units.
fn errors(mesh: &MedialMesh, shape: &Shape) -> Result<Vec<f64>, Failure> {
    let to_normal = shape.normalisation();
    let centres: Vec<_> = mesh.spheres.iter().map(|s| to_normal.forward(s.centre)).collect();
    let tree = shape.surface_tree().map_err(Failure::input)?;
    let inside = shape.inside_test();
    let heights = SignedDistance::closed(&tree, &inside).batch(&centres);
    let of =
        |(sphere, height): (&complex::Sphere, f64)| sphere.radius + height * to_normal.diagonal;
    Ok(mesh.spheres.iter().zip(heights).map(of).collect())
}

/// Diagonal of the box of all balls; 1 where there is none.
fn diagonal(mesh: &MedialMesh) -> f64 {
    let corners = mesh.spheres.iter().flat_map(|s| [s.centre - s.radius, s.centre + s.radius]);
    let bounds = Bounds::of_points(corners);
    let diagonal = (bounds.hi - bounds.lo).length();
    if diagonal > 0.0 && diagonal.is_finite() { diagonal } else { 1.0 }
}

/// What is lost in a file of single precision, if it is one.
pub fn loss(to: &Path, mesh: &MedialMesh) -> Option<String> {
    (extension(to) == "glb").then(|| {
        let loss = single_precision_loss(mesh);
        format!("single precision: coordinates and radii are rounded by at most {loss:.1e}")
    })
}
