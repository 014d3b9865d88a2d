//! Pictures whose content is known.

use std::f64::consts::PI;

use medial::Vec3;
use medial::complex::{MedialMesh, Sphere};
use medial::surface::TriMesh;

use super::light::{decode, encode};
use super::*;

/// A sphere of a radius on a grid of longitudes and latitudes.
fn sphere(radius: f64, steps: u32) -> TriMesh {
    let at = |i: u32, j: u32| {
        let (s, c) = (PI * f64::from(i) / f64::from(steps)).sin_cos();
        let (sin, cos) = (2.0 * PI * f64::from(j) / f64::from(2 * steps)).sin_cos();
        radius * Vec3::new(s * cos, c, s * sin)
    };
    let vertices = (0..=steps).flat_map(|i| (0..2 * steps).map(move |j| at(i, j))).collect();
    let index = |i: u32, j: u32| i * 2 * steps + j % (2 * steps);
    let quads = (0..steps).flat_map(|i| (0..2 * steps).map(move |j| (i, j)));
    let faces = quads.flat_map(|(i, j)| {
        let [a, b, c, d] = [index(i, j), index(i, j + 1), index(i + 1, j + 1), index(i + 1, j)];
        [[a, b, c], [a, c, d]]
    });
    TriMesh { vertices, faces: faces.collect() }
}

/// A square of a half width at a height along the line of sight.
fn square(half: f64, z: f64) -> TriMesh {
    let corner = |x: f64, y: f64| Vec3::new(half * x, half * y, z);
    let vertices = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    TriMesh { vertices, faces: vec![[0, 1, 2], [0, 2, 3]] }
}

fn front() -> Camera {
    Camera::new(Vec3::Z, Vec3::Y)
}

/// A picture with the camera set up by a mesh.
fn picture_from(
    layers: Vec<Layer<'_>>,
    camera: &Camera,
    mesh: &TriMesh,
    size: [usize; 2],
    background: Background,
) -> Picture {
    let frame = Frame::fit(camera, &mesh.vertices).expect("a frame");
    Scene { layers, size, background }.picture(&frame).expect("a picture")
}

/// The radius on the picture follows from the margin: the shape fills the shorter side.
#[test]
fn a_sphere_is_a_disc() {
    let mesh = sphere(3.0, 48);
    let layers = vec![Layer::Surface(&mesh)];
    let picture = picture_from(layers, &front(), &mesh, [240, 200], Background::Transparent);
    let alpha = picture.pixels.iter().map(|pixel| f64::from(pixel[3]) / 255.0);
    let (area, radius) = (alpha.sum::<f64>(), 100.0 - 0.04 * 200.0);
    let expected = PI * radius * radius;
    assert!((area / expected - 1.0).abs() < 0.004, "{area} for {expected}");
    assert_eq!(picture.pixel(0, 0), Some([255, 255, 255, 0]));
    assert_eq!(picture.pixel(120, 100).map(|pixel| pixel[3]), Some(255));
}

/// Facets that face the eye are lit only by the lamp at the viewer's shoulder.
#[test]
fn the_middle_of_a_sphere_has_the_light_of_the_lamp() {
    let mesh = sphere(1.0, 48);
    let values = vec![1.0; mesh.vertices.len()];
    let scale = Scale { lo: 0.0, hi: 1.0, map: ColourMap::Viridis };
    let layers = vec![Layer::Values { mesh: &mesh, values: &values, scale }];
    let picture = picture_from(layers, &front(), &mesh, [240, 200], Background::WHITE);
    let Some([r, g, b, 255]) = picture.pixel(120, 100) else { panic!("opaque") };
    let full = decode(ColourMap::Viridis.at(1.0));
    let strength =
        0.34 + 0.66 * 0.79 / (0.38_f32.powi(2) + 0.48_f32.powi(2) + 0.79_f32.powi(2)).sqrt();
    let expected = encode(full.map(|light| light * strength));
    for (found, expected) in [r, g, b].into_iter().zip(expected) {
        assert!(found.abs_diff(expected) <= 2, "{found} {expected}");
    }
}

#[test]
fn nearer_facets_hide_farther_ones() {
    let (near, far) = (square(1.0, 0.5), square(2.0, -0.5));
    let values = vec![0.0; 4];
    let at = |lo: f64| Scale { lo, hi: lo + 1.0, map: ColourMap::Diverging };
    let red = Layer::Values { mesh: &near, values: &values, scale: at(-1.0) };
    let blue = Layer::Values { mesh: &far, values: &values, scale: at(0.0) };
    for layers in [vec![blue, red], vec![red, blue]] {
        let [before, behind] = [Vec3::Z, -Vec3::Z].map(|direction| {
            let camera = Camera::new(direction, Vec3::Y);
            let picture =
                picture_from(layers.clone(), &camera, &far, [100, 100], Background::WHITE);
            move |x, y| picture.pixel(x, y).is_some_and(|[r, _, b, _]| r > b)
        });
        assert!(before(50, 50) && !before(10, 10) && !behind(50, 50));
    }
}

/// A sheet, a curve and an isolated sphere.
fn axis() -> MedialMesh {
    let at = |x: f64, y: f64, r: f64| Sphere::new(Vec3::new(x, y, 0.0), r);
    let spheres = vec![
        at(-0.8, -0.5, 0.1),
        at(0.0, -0.5, 0.2),
        at(-0.4, 0.4, 0.3),
        at(0.6, 0.3, 0.2),
        at(0.6, -0.6, 0.1),
    ];
    MedialMesh::from_simplices(spheres, vec![[1, 3]], vec![[0, 1, 2]]).expect("a complex")
}

#[test]
fn sheets_curves_and_isolated_spheres_show_inside_glass() {
    let (surface, axis) = (sphere(1.0, 24), axis());
    let layers = vec![Layer::Axis { mesh: &axis, colour: None }, Layer::Glass(&surface)];
    let picture = picture_from(layers, &front(), &surface, [400, 400], Background::Transparent);
    // A unit is 184 pixels.
    let at = |x: f64, y: f64| {
        picture.pixel((200.0 + 184.0 * x) as usize, (200.0 - 184.0 * y) as usize).expect("a pixel")
    };
    let (sheet, curve, dot, glass) = (at(-0.4, -0.2), at(0.3, -0.1), at(0.6, -0.6), at(0.0, 0.7));
    assert!(sheet[3] == 255 && sheet[2] > sheet[0], "{sheet:?}");
    assert!(curve[3] == 255 && curve[0] > curve[2], "{curve:?}");
    assert!(dot[3] == 255 && dot[0] > dot[2], "{dot:?}");
    assert!((1..100).contains(&glass[3]), "{glass:?}");
    assert_eq!(at(0.9, 0.9)[3], 0);
}

#[test]
fn every_srgb_code_survives_decoding() {
    for code in 0..=255 {
        assert_eq!(encode(decode([code; 3])), [code; 3]);
    }
}

/// A ghost does not cover other layers, and shows only where they are absent.
#[test]
fn a_ghost_shows_missing_parts() {
    let (whole, part) = (square(1.0, 0.5), square(0.5, 0.0));
    let [with, without] = [true, false].map(|ghost| {
        let mut layers = vec![Layer::Surface(&part)];
        layers.extend(ghost.then_some(Layer::Ghost(&whole)));
        picture_from(layers, &front(), &whole, [100, 100], Background::Transparent)
    });
    assert_eq!(with.pixel(50, 50), without.pixel(50, 50));
    assert_eq!(without.pixel(15, 15).map(|pixel| pixel[3]), Some(0));
    assert!(with.pixel(15, 15).is_some_and(|pixel| (1..128).contains(&pixel[3])));
}

/// No seam shines through between facets, and none is drawn twice as glass.
#[test]
fn facets_neither_gape_nor_overlap() {
    let mesh = square(1.0, 0.0);
    let camera = Camera::new(Vec3::new(0.3, 0.2, 1.0), Vec3::new(0.1, 1.0, 0.0));
    let [solid, glass] = [Layer::Surface(&mesh), Layer::Glass(&mesh)].map(|layer| {
        let clear = Background::Transparent;
        let picture = picture_from(vec![layer], &camera, &mesh, [240, 200], clear);
        let alpha: Vec<u8> = picture.pixels.iter().map(|pixel| pixel[3]).collect();
        (0..40).map(|k| alpha[(80 + k) * 240 + 100 + k]).collect::<Vec<_>>()
    });
    assert!(solid.iter().all(|&alpha| alpha == 255));
    assert!(glass.iter().all(|&alpha| alpha == glass[0] && alpha > 0), "{glass:?}");
}

#[test]
fn a_strip_has_a_panel_for_each_and_a_bar() {
    let (surface, axis) = (sphere(1.0, 12), axis());
    let values: Vec<f64> = surface.vertices.iter().map(|v| 0.1 * v.x).collect();
    let errors = Errors { mesh: &surface, values: &values, caption: "error".into() };
    let panel = |errors| Panel { axis: &axis, caption: "five spheres".into(), errors };
    let common = Strip {
        surface: &surface,
        diagonal: 2.0,
        camera: front(),
        size: [160, 120],
        across: 2,
        background: Background::WHITE,
        colour: ColourBy::Radius,
        max_error: None,
    };
    let one = strip(&[panel(None), panel(None)], &common).expect("a strip");
    let two = strip(&[panel(Some(errors)), panel(None)], &common).expect("a strip");
    assert_eq!(one.width, 2 * 160 + Bar::column(common.size));
    assert_eq!((two.width, two.height), (one.width, 2 * one.height));
    // A third one begins the next line.
    let three = strip(&[panel(None), panel(None), panel(None)], &common).expect("a strip");
    assert_eq!((three.width, three.height), (one.width, 2 * one.height));
    // Alike but for the place: panels of one mesh are one picture.
    let column = |x: usize| (0..120).filter_map(|y| one.pixel(x, y)).collect::<Vec<_>>();
    assert!((0..160).all(|x| column(x) == column(160 + x)));
    assert_eq!(strip(&[], &common), Err(RenderError::Empty));
}

/// Most of a comparison's panels are far from the surface: the scale is for those that are near.
#[test]
fn the_scale_of_errors_shows_the_better_half() {
    let surface = sphere(1.0, 4);
    let sizes = [0.004, 0.005, 0.006, 0.2, 0.25, 0.3, 0.4];
    let values = sizes.map(|size| vec![2.0 * size; surface.vertices.len()]);
    let panels: Vec<Errors<'_>> = (values.iter())
        .map(|values| Errors { mesh: &surface, values, caption: String::new() })
        .collect();
    let all: Vec<&Errors<'_>> = panels.iter().collect();
    let end = Errors::common_scale(&all, 2.0) / 2.0;
    assert!((0.01..=0.02).contains(&end), "{end}");
    assert_eq!(
        Errors::bar(&all, 2.0 * end, 2.0).note,
        ["blue: falls short", "larger values:", "last colour"]
    );
    assert_eq!(Errors::bar(&all[..2], 2.0 * end, 2.0).note, ["blue: falls short"]);
}

#[test]
fn invalid_scenes_are_rejected() {
    let mesh = sphere(1.0, 4);
    let frame = Frame::fit(&front(), &mesh.vertices).expect("a frame");
    let scene = |layers, size| Scene { layers, size, background: Background::WHITE };
    let small = scene(vec![Layer::Surface(&mesh)], [4, 100]).picture(&frame);
    assert!(matches!(small, Err(RenderError::Size { width: 4, .. })));
    let scale = Scale::errors(1.0);
    let values = Layer::Values { mesh: &mesh, values: &[1.0], scale };
    let vertices = mesh.vertices.len();
    let few = scene(vec![values], [100, 100]).picture(&frame);
    assert_eq!(few, Err(RenderError::Values { values: 1, vertices }));
    let nothing = scene(vec![], [100, 100]);
    let background = nothing.picture(&frame).expect("a picture");
    assert!(background.pixels.iter().all(|pixel| *pixel == [255; 4]));
}
