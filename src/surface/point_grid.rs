//! A hash grid of points that grows.

use std::collections::HashMap;

use crate::Vec3;

/// Points by the cell of a grid.
pub(crate) struct PointGrid {
    cell: f64,
    all: Vec<Vec3>,
    by_cell: HashMap<[i64; 3], Vec<Vec3>>,
}

impl PointGrid {
    pub fn new(cell: f64) -> Self {
        Self { cell, all: Vec::new(), by_cell: HashMap::new() }
    }

    fn place(&self, p: Vec3) -> [i64; 3] {
        (p / self.cell).floor().to_array().map(|place| place as i64)
    }

    pub fn insert(&mut self, p: Vec3) {
        self.all.push(p);
        self.by_cell.entry(self.place(p)).or_default().push(p);
    }

    pub fn any_within(&self, centre: Vec3, radius: f64) -> bool {
        let is_within = |p: &Vec3| p.distance(centre) < radius;
        // A large sphere covers more cells than there are points.
        if (2.0 * radius / self.cell + 1.0).powi(3) > self.all.len() as f64 {
            return self.all.iter().any(is_within);
        }
        let [low, high] = [-radius, radius].map(|by| self.place(centre + by));
        let cells = (low[0]..=high[0])
            .flat_map(|x| (low[1]..=high[1]).map(move |y| [x, y]))
            .flat_map(|[x, y]| (low[2]..=high[2]).map(move |z| [x, y, z]));
        cells.filter_map(|cell| self.by_cell.get(&cell)).flatten().any(is_within)
    }
}
