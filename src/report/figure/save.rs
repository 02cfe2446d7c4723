//! One way to write a picture as SVG, PNG and PDF.

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use resvg::{tiny_skia, usvg};

use super::{FONT, FigureError, Sheet, Style, pdf::pdf};
use crate::store::{MARK, Outputs, beside, replace};

/// Units of length of a picture in an inch.
const UNITS: f32 = 96.0;

/// How pictures are written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output {
    /// Dots per inch of a PNG.
    pub dpi: u16,
    /// How sheets are drawn.
    pub style: Style,
}

impl Default for Output {
    fn default() -> Self {
        Output { dpi: 192, style: Style::default() }
    }
}

/// A picture that is not yet written.
pub struct Drawing<'s> {
    /// Its name without the ending.
    pub stem: PathBuf,
    /// What is on it.
    pub sheet: Sheet<'s>,
}

/// Write `STEM.svg`, `STEM.png` and `STEM.pdf` of all drawings, or, where one of them may not be written, none; returns the paths.
pub fn save(
    drawings: &[Drawing],
    outputs: &Outputs,
    how: &Output,
) -> Result<Vec<PathBuf>, FigureError> {
    let mut files = vec![];
    for Drawing { stem, sheet } in drawings {
        let svg = sheet.svg(&how.style)?;
        let marked = match svg.find('>') {
            Some(end) => format!("{}\n{MARK}{}", &svg[..=end], &svg[end + 1..]),
            None => svg.clone(),
        };
        files.push((beside(stem, ".svg"), marked.into_bytes()));
        let tree = tree(&svg)?;
        let png = pixels(&tree, f32::from(how.dpi) / UNITS)?;
        let png = png.encode_png().map_err(FigureError::draw)?;
        files.push((beside(stem, ".png"), marked_png(png)));
        let title = stem.file_name().map(|n| n.to_string_lossy()).unwrap_or_default();
        files.push((beside(stem, ".pdf"), pdf(&tree, &title)?));
    }
    files.iter().try_for_each(|(path, _)| outputs.check_derived(path))?;
    files.iter().try_for_each(|(path, bytes)| replace(path, bytes))?;
    Ok(files.into_iter().map(|f| f.0).collect())
}

/// A PNG that says which program made it: a chunk of text behind the header.
fn marked_png(png: Vec<u8>) -> Vec<u8> {
    /// Signature and header.
    const HEAD: usize = 8 + 25;
    let text = b"tEXtSoftware\0signorini";
    if png.len() < HEAD {
        return png;
    }
    let mut out = png[..HEAD].to_vec();
    out.extend(((text.len() - 4) as u32).to_be_bytes());
    out.extend(text);
    out.extend(crc32fast::hash(text).to_be_bytes());
    out.extend(&png[HEAD..]);
    out
}

/// Write frames one after the other as `STEM.apng`, which browsers and presentations play without end; returns its path.
pub fn animate(
    stem: &Path,
    frames: &[String],
    outputs: &Outputs,
    (dpi, rate): (u16, u16),
) -> Result<PathBuf, FigureError> {
    let path = beside(stem, ".apng");
    outputs.check_derived(&path)?;
    let drawn: Result<Vec<_>, FigureError> =
        frames.par_iter().map(|svg| pixels(&tree(svg)?, f32::from(dpi) / UNITS)).collect();
    let drawn = drawn?;
    let first = drawn.first().ok_or(FigureError::Empty("there are no states to play"))?;
    let mut bytes = vec![];
    {
        let mut encoder = png::Encoder::new(&mut bytes, first.width(), first.height());
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::High);
        encoder.set_animated(drawn.len() as u32, 0).map_err(FigureError::draw)?;
        encoder.set_frame_delay(1, rate).map_err(FigureError::draw)?;
        let mark = encoder.add_text_chunk("Software".into(), "signorini".into());
        mark.map_err(FigureError::draw)?;
        let mut writer = encoder.write_header().map_err(FigureError::draw)?;
        for frame in &drawn {
            // pictures have a white ground: nothing shines through
            let colours: Vec<u8> =
                frame.data().chunks_exact(4).flat_map(|p| &p[..3]).copied().collect();
            writer.write_image_data(&colours).map_err(FigureError::draw)?;
        }
        writer.finish().map_err(FigureError::draw)?;
    }
    replace(&path, &bytes)?;
    Ok(path)
}

/// The shapes of an SVG, with the font that the program carries.
fn tree(svg: &str) -> Result<usvg::Tree, FigureError> {
    let mut options = usvg::Options::default();
    let fonts = options.fontdb_mut();
    fonts.load_font_data(FONT.to_vec());
    fonts.set_sans_serif_family("DejaVu Sans");
    usvg::Tree::from_str(svg, &options).map_err(FigureError::draw)
}

fn pixels(tree: &usvg::Tree, scale: f32) -> Result<tiny_skia::Pixmap, FigureError> {
    let size = tree.size();
    let pixels = |x: f32| (x * scale).round() as u32;
    let mut pixmap = tiny_skia::Pixmap::new(pixels(size.width()), pixels(size.height()))
        .ok_or_else(|| FigureError::Draw("the picture is too large".into()))?;
    let transform = tiny_skia::Transform::from_scale(scale, scale);
    resvg::render(tree, transform, &mut pixmap.as_mut());
    Ok(pixmap)
}
