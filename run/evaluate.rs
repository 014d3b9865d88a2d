//! Every metric of one medial mesh of a surface.

use medial::complex::MedialMesh;
use medial::metrics::{Evaluation, Judge, MetricError};
use medial::shape::Shape;

/// A shape, and the measurements of medial meshes of it.
pub struct Evaluator<'a> {
    /// The shape.
    pub shape: &'a Shape,
    /// Measures medial meshes against the shape.
    pub judge: &'a Judge,
    /// Width of the certified intervals, a fraction of the diagonal; `None` for the default of the judge.
    pub certify: Option<f64>,
    /// Whether edges and faces are dropped before the evaluation.
    pub spheres_alone: bool,
    /// A medial mesh to compare with as a set of points and by its sheets, in input units.
    pub reference: Option<&'a MedialMesh>,
}

impl Evaluator<'_> {
    /// Measures a medial mesh in input units. Points of the result are in input units, lengths are fractions of the
    /// diagonal.
    ///
    /// # Errors
    /// When the medial mesh has no union, or the certificate is too narrow.
    pub fn evaluate(&self, mesh: &MedialMesh) -> Result<Evaluation, MetricError> {
        let units = self.shape.normalisation();
        let mesh = mesh.to_normal(units);
        let mesh = if self.spheres_alone { mesh.spheres_alone() } else { mesh };
        let mut evaluation = self.judge.evaluate_certified(&mesh, self.certify)?;
        // Points are looked for in the surface file.
        evaluation.move_witnesses(|point| units.backward(point));
        if let Some(reference) = self.reference {
            let reference = reference.to_normal(units);
            evaluation.axis = Some(self.judge.axis_difference(&mesh, &reference)?);
            if let Some(structure) = &mut evaluation.structure {
                structure.known = Some(self.judge.sheet_difference(&mesh, &reference)?);
            }
        }
        Ok(evaluation)
    }
}
