//! What is typed for cameras, sizes and colours, as values; what is not understood is named.

use medial::Vec3;
use medial::surface::TriMesh;
use medial_reports::render::{Background, Camera};

use super::Arguments;
use crate::exit::Failure;

/// Named views: azimuth and elevation in degrees. From the top and the bottom, what is up lies along the line of sight,
/// so these are a little off.
const VIEWS: [(&str, f64, f64); 7] = [
    ("front", 0.0, 0.0),
    ("right", 90.0, 0.0),
    ("back", 180.0, 0.0),
    ("left", -90.0, 0.0),
    ("top", 0.0, 89.5),
    ("bottom", 0.0, -89.5),
    ("iso", 45.0, 35.264),
];

/// The camera that is asked for, or the one that shows most of the surface.
pub fn camera(arguments: &Arguments, surface: &TriMesh) -> Result<Camera, Failure> {
    let up = arguments.up.as_deref().map(upwards).transpose()?;
    let camera = match (arguments.camera.as_deref().map(str::trim), up) {
        (None | Some("auto"), None) => Camera::fitting(surface),
        (None | Some("auto"), Some(up)) => Camera::around(up, 28.0, 20.0),
        (Some(text), up) => from_words(text, up.unwrap_or_else(|| Camera::fitting_up(surface)))?,
    };
    Ok(Camera { zoom: arguments.zoom, perspective: arguments.perspective, ..camera })
}

fn from_words(text: &str, up: Vec3) -> Result<Camera, Failure> {
    let lower = text.to_ascii_lowercase();
    if let Some(&(_, azimuth, elevation)) = VIEWS.iter().find(|view| view.0 == lower) {
        return Ok(Camera::around(up, azimuth, elevation));
    }
    match numbers(text).as_deref() {
        Some(&[azimuth, elevation]) if elevation.abs() < 90.0 => {
            Ok(Camera::around(up, azimuth, elevation))
        }
        Some(&[x, y, z]) => Ok(Camera::new(Vec3::new(x, y, z), up)),
        _ => {
            let names: Vec<_> = VIEWS.iter().map(|view| view.0).collect();
            Err(Failure::usage(format!(
                "--camera {text}: write one of {}, or AZIMUTH,ELEVATION in degrees with an elevation between -90 and 90, \
                 or a direction X,Y,Z from the shape to the eye",
                names.join(", ")
            )))
        }
    }
}

/// Numbers between commas, if all are finite.
fn numbers(text: &str) -> Option<Vec<f64>> {
    let number = |word: &str| word.trim().parse().ok().filter(|x: &f64| x.is_finite());
    text.split(',').map(number).collect()
}

fn upwards(text: &str) -> Result<Vec3, Failure> {
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
    axis.ok_or_else(|| {
        Failure::usage(format!("--up {text}: write x, y, z, -x, -y, -z or a direction X,Y,Z"))
    })
}

/// Width and height from `WxH`.
pub fn size(text: &str) -> Result<[usize; 2], Failure> {
    let sides = text.split_once(['x', 'X']).and_then(|(width, height)| {
        Some([width.trim().parse().ok()?, height.trim().parse().ok()?])
    });
    sides.ok_or_else(|| {
        Failure::usage(format!("--size {text}: write WIDTHxHEIGHT in pixels, such as 800x600"))
    })
}

/// What is behind the picture.
pub fn background(text: &str) -> Result<Background, Failure> {
    let code = |hex: &str, k: usize| u8::from_str_radix(hex.get(2 * k..2 * k + 2)?, 16).ok();
    let colour = |hex: &str| {
        // A sign would be taken for a digit's.
        let is_hex = hex.len() == 6 && hex.bytes().all(|b| b.is_ascii_hexdigit());
        is_hex.then(|| Some([code(hex, 0)?, code(hex, 1)?, code(hex, 2)?])).flatten()
    };
    let found = match text {
        "white" => Some(Background::WHITE),
        "black" => Some(Background::Colour([0; 3])),
        "transparent" => Some(Background::Transparent),
        _ => text.strip_prefix('#').and_then(colour).map(Background::Colour),
    };
    found.ok_or_else(|| {
        Failure::usage(format!("--background {text}: write white, black, transparent or #rrggbb"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_understood() {
        assert_eq!(size("800x600").ok(), Some([800, 600]));
        assert_eq!(background("#0a0B0c").ok(), Some(Background::Colour([10, 11, 12])));
        assert_eq!(upwards("-z").ok(), Some(-Vec3::Z));
        assert_eq!(upwards("0,3,0").ok(), Some(Vec3::Y));
        let around = |text| from_words(text, Vec3::Y).ok().map(|camera| camera.direction);
        assert!(around("right").is_some_and(|d| d.distance(Vec3::X) < 1e-12));
        assert!(around("-90,0").is_some_and(|d| d.distance(-Vec3::X) < 1e-12));
        assert_eq!(around("1,2,3"), Some(Vec3::new(1.0, 2.0, 3.0)));
    }

    #[test]
    fn what_is_not_understood_is_named() {
        let said = |failure: Option<Failure>, word: &str| {
            assert!(failure.is_some_and(|failure| failure.message.contains(word)), "{word}");
        };
        for text in ["800", "800x", "x600", "-1x5", "800x600x2"] {
            said(size(text).err(), text);
        }
        for text in ["red", "#12345", "#1234567", "#+1+1+1", "#äöü"] {
            said(background(text).err(), text);
        }
        for text in ["w", "0,0,0", "1,2", "nan,0,1"] {
            said(upwards(text).err(), text);
        }
        for text in ["somewhere", "1", "0,90", "1,2,3,4", "inf,0"] {
            said(from_words(text, Vec3::Y).err(), text);
        }
    }
}
