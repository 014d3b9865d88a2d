//! The power crust of the spheres of a medial mesh, or of all inner poles, and of the outer poles.

use medial::complex::MedialMesh;
use medial::geometry::PowerCrust;
use medial::shape::{Cost, Shape};
use medial::surface;
use serde_json::{Map, Value};

use super::{Arguments, Made, Said, Stages, no_mesh};
use crate::exit::Failure;

/// Corners of the power crust that are nearer than this along it are one, as a fraction of the
/// diagonal.
pub const COINCIDENT: f64 = 1e-6;

/// The power crust of the spheres of the medial mesh, or of all inner poles, and of the outer poles.
pub fn surface_of(
    arguments: &Arguments,
    shape: Option<&Shape>,
    axis: Option<&MedialMesh>,
    stages: &mut Stages,
) -> Result<Made, Failure> {
    let (Some(shape), Some(mesh)) = (shape, &arguments.mesh) else {
        return Err(no_mesh());
    };
    let of_mesh = |message: String| Failure::input(format!("{}: {message}", mesh.display()));
    let (balls, lap) = Cost::of(|| shape.polar_balls());
    stages.add("poles", lap);
    let balls = balls.map_err(|error| of_mesh(error.to_string()))?;
    let to_normal = shape.normalisation();
    let inner = match axis {
        Some(axis) => axis.transformed(1.0 / to_normal.diagonal, |p| to_normal.forward(p)).spheres,
        None => balls.inner,
    };
    let (counts, named) =
        ([inner.len(), balls.outer.len()], arguments.axis.as_ref().unwrap_or(mesh));
    let of_named = |message: String| Failure::input(format!("{}: {message}", named.display()));
    let (crust, lap) = Cost::of(|| {
        let crust = PowerCrust::new(&inner, &balls.outer)?;
        Ok((crust.facet_count(), surface::crust_surface(&crust, COINCIDENT)))
    });
    stages.add("reconstruct", lap);
    let (facets, mut crust) =
        crust.map_err(|error: medial::geometry::TriangulationError| of_named(error.to_string()))?;
    if crust.mesh.faces.is_empty() {
        return Err(of_named(
            "no inner ball has a power cell: is the medial mesh of this surface, and in its units?"
                .into(),
        ));
    }
    for vertex in &mut crust.mesh.vertices {
        *vertex = to_normal.backward(*vertex);
    }
    let more = Map::from_iter([
        ("inner".to_owned(), Value::from(counts[0])),
        ("outer".to_owned(), Value::from(counts[1])),
        ("rejected".to_owned(), Value::from(balls.rejected)),
        ("facets".to_owned(), Value::from(facets)),
        ("merged".to_owned(), Value::from(crust.contracted)),
        ("samples".to_owned(), Value::from(shape.samples().len())),
        ("sampling".to_owned(), Value::from(shape.options().sampling.to_string())),
        ("seed".to_owned(), Value::from(arguments.substrate.seed)),
    ]);
    let said = Said { diagonal: to_normal.diagonal, tolerance: COINCIDENT, union: None, more };
    Ok(Made { mesh: crust.mesh, said, warnings: vec![] })
}
