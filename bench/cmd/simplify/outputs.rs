//! The files that `simplify` writes: what can be refused before the work, and the writing.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use medial::complex;
use medial::shape::Shape;
use medial::simplifier::{MedialSimplifier, Simplified};
use medial::surface::{self, TriMesh};
use medial_methods::aof::{self, LatticeVoxels};
use medial_methods::tam_heidrich::{self, OuterPoles, RemainingPoles};
use serde_json::json;

use crate::cmd::reconstruct::COINCIDENT;
use crate::exit::Failure;
use crate::files::{SURFACES, check_extension, check_folder, check_output};

/// Files to write.
#[derive(Debug, Args)]
pub struct Outputs {
    /// The result (.ma, .ply, .obj, .vtp, .glb), in the units of the surface.
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Write the voxels with their distance and flux (.csv), for methods on a lattice.
    #[arg(long, value_name = "FILE")]
    voxels: Option<PathBuf>,
    /// Write the power crust of the poles that are left (.ply, .off, .obj), for methods that prune
    /// by parts.
    #[arg(long, value_name = "FILE")]
    power_crust: Option<PathBuf>,
    /// Outer poles that this power crust takes.
    #[arg(long, value_enum, default_value_t = Outer::All, requires = "power_crust")]
    outer_poles: Outer,
}

/// Outer poles of a power crust.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Outer {
    /// Those of all samples.
    All,
    /// Not those of removed features: sharper where the shape has corners.
    Remaining,
}

impl Outputs {
    /// Refuses what the method has not or what could not be written, before anything is computed.
    ///
    /// # Errors
    /// When an extension is unknown, a folder not there, or the method has no such thing.
    pub fn check(&self, method: &dyn MedialSimplifier) -> Result<(), Failure> {
        let info = method.info();
        let needs = |option: &str, extra: &str, what: &str| match info.has_extra(extra) {
            true => Ok(()),
            false => Err(Failure::usage(format!("{option}: {} has no {what}", info.id))),
        };
        check_output(self.output.as_deref())?;
        if let Some(path) = &self.voxels {
            needs("--voxels", aof::VOXELS, "voxels")?;
            check_extension(path, &["csv"])?;
            check_folder(path)?;
        }
        if let Some(path) = &self.power_crust {
            needs("--power-crust", tam_heidrich::POLES, "poles")?;
            check_extension(path, &SURFACES)?;
            check_folder(path)?;
        }
        Ok(())
    }

    /// Writes the requested files.
    ///
    /// # Errors
    /// When the poles have no power crust, and then nothing is written, or when a file cannot be
    /// written.
    pub fn write(&self, result: &Simplified, shape: &Shape) -> Result<(), Failure> {
        // Before anything is written: whether there is a crust shows only when it is made.
        let crust = match (&self.power_crust, result.extras.get()) {
            (Some(path), Some(poles)) => Some((path, self.crust(path, poles, shape)?)),
            _ => None,
        };
        if let Some(path) = &self.output {
            let back = shape.normalisation();
            let mesh = result.mesh.transformed(back.diagonal, |p| back.backward(p));
            complex::write(path, &mesh).map_err(Failure::input)?;
        }
        if let (Some(path), Some(voxels)) = (&self.voxels, result.extras.get::<LatticeVoxels>()) {
            write_voxels(path, voxels, shape)?;
        }
        if let Some((path, crust)) = crust {
            surface::write(path, &crust).map_err(Failure::input)?;
        }
        Ok(())
    }

    /// The power crust for the file `path`, in the units of the surface.
    fn crust(
        &self,
        path: &Path,
        poles: &RemainingPoles,
        shape: &Shape,
    ) -> Result<TriMesh, Failure> {
        let outer = match self.outer_poles {
            Outer::All => OuterPoles::All,
            Outer::Remaining => OuterPoles::OfRemaining,
        };
        let of_file = |why: String| Failure::input(format!("{}: {why}", path.display()));
        let crust = poles.power_crust(shape, outer).map_err(|error| of_file(error.to_string()))?;
        let mut crust = surface::crust_surface(&crust, COINCIDENT).mesh;
        if crust.faces.is_empty() {
            return Err(of_file("no pole is left: nothing to make a surface of".into()));
        }
        let back = shape.normalisation();
        crust.vertices.iter_mut().for_each(|vertex| *vertex = back.backward(*vertex));
        Ok(crust)
    }

    /// What was written, a line each.
    pub fn written(&self) -> Vec<String> {
        let files = [
            (&self.output, ""),
            (&self.voxels, ", a point for each voxel"),
            (&self.power_crust, ", the power crust of the poles that are left"),
        ];
        let written = files.into_iter().filter_map(|(path, what)| {
            path.as_ref().map(|path| format!("written: {}{what}", path.display()))
        });
        written.collect()
    }
}

/// Writes a line for each voxel: its centre and distance in the units of the surface, its flux, and
/// its indices in the lattice.
fn write_voxels(path: &Path, voxels: &LatticeVoxels, shape: &Shape) -> Result<(), Failure> {
    let back = shape.normalisation();
    let write = |out: &mut dyn Write| -> io::Result<()> {
        writeln!(out, "x,y,z,distance,flux,i,j,k")?;
        for voxel in &voxels.voxels {
            let [x, y, z] = back.backward(voxels.centre(voxel)).to_array();
            let ([i, j, k], distance) = (voxel.place, voxel.distance * back.diagonal);
            writeln!(out, "{x},{y},{z},{distance},{},{i},{j},{k}", voxel.flux)?;
        }
        Ok(())
    };
    medial::write_atomically(path, |out| write(out))
        .map_err(|error| Failure::input(format!("{}: {error}", path.display())))
}

/// The lattice of the voxels, for the JSON of the result.
pub(super) fn describe_voxels(voxels: &LatticeVoxels, shape: &Shape) -> serde_json::Value {
    let back = shape.normalisation();
    json!({
        "count": voxels.voxels.len(),
        "origin": back.backward(voxels.origin).to_array(),
        "side": voxels.side * back.diagonal,
        "size": voxels.size,
        "betti": voxels.betti(),
    })
}
