//! A picture as PDF: the shapes of its SVG, and its letters as outlines, so that nothing depends on fonts. What the pictures of this program do not have (clipped groups, gradients, images)
//! is an error, never left out.

use std::collections::BTreeMap;
use std::io::Write as _;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use pdf_writer::types::{LineCapStyle, LineJoinStyle};
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref, TextStr};
use resvg::tiny_skia::{PathSegment, Point, Transform};
use resvg::usvg;

use super::FigureError;

/// Points of PDF in a unit of SVG: 72 of the one and 96 of the other are an inch.
const POINTS: f32 = 72.0 / 96.0;

/// The bytes of the PDF.
pub fn pdf(tree: &usvg::Tree, title: &str) -> Result<Vec<u8>, FigureError> {
    let (width, height) = (tree.size().width() * POINTS, tree.size().height() * POINTS);
    // y of PDF goes up
    let upright = Transform::from_row(POINTS, 0.0, 0.0, -POINTS, 0.0, height);
    let mut page = Page { content: Content::new(), opacities: BTreeMap::new() };
    page.group(tree.root(), upright, 1.0)?;
    let [info, catalog, pages, sheet, content] = [1, 2, 3, 4, 5].map(Ref::new);
    let mut file = Pdf::new();
    // first: it tells whose file it is
    file.document_info(info).producer(TextStr("signorini")).title(TextStr(title));
    file.catalog(catalog).pages(pages);
    file.pages(pages).kids([sheet]).count(1);
    let mut zipped = ZlibEncoder::new(vec![], Compression::default());
    zipped.write_all(&page.content.finish()).map_err(FigureError::draw)?;
    let zipped = zipped.finish().map_err(FigureError::draw)?;
    let mut leaf = file.page(sheet);
    leaf.parent(pages).contents(content).media_box(Rect::new(0.0, 0.0, width, height));
    let mut resources = leaf.resources();
    let mut states = resources.ext_g_states();
    for (&(fill, stroke), name) in &page.opacities {
        let mut state =
            states.insert(Name(name.as_bytes())).start::<pdf_writer::writers::ExtGraphicsState>();
        state.non_stroking_alpha(f32::from_bits(fill)).stroking_alpha(f32::from_bits(stroke));
    }
    states.finish();
    resources.finish();
    leaf.finish();
    file.stream(content, &zipped).filter(Filter::FlateDecode);
    Ok(file.finish())
}

struct Page {
    content: Content,
    /// Names of the graphics states, by the bits of the opacities of areas and lines.
    opacities: BTreeMap<(u32, u32), String>,
}

fn unknown(what: &str) -> FigureError {
    FigureError::Draw(format!("{what} cannot be written as PDF"))
}

fn colour(paint: &usvg::Paint) -> Result<[f32; 3], FigureError> {
    match paint {
        usvg::Paint::Color(c) => Ok([c.red, c.green, c.blue].map(|part| f32::from(part) / 255.0)),
        _ => Err(unknown("a gradient")),
    }
}

impl Page {
    fn group(
        &mut self,
        group: &usvg::Group,
        at: Transform,
        opacity: f32,
    ) -> Result<(), FigureError> {
        let at = at.pre_concat(group.transform());
        if group.clip_path().is_some() || group.mask().is_some() || !group.filters().is_empty() {
            return Err(unknown("a clipped or filtered group"));
        }
        // shapes of one group that lie on each other would shine through each other
        let own = group.opacity().get();
        if own < 1.0 && group.children().len() > 1 {
            return Err(unknown("a group of several shapes that something shines through"));
        }
        for node in group.children() {
            match node {
                usvg::Node::Group(inner) => self.group(inner, at, opacity * own)?,
                usvg::Node::Path(path) => self.path(path, at, opacity * own)?,
                usvg::Node::Text(text) => self.group(text.flattened(), at, opacity * own)?,
                usvg::Node::Image(_) => return Err(unknown("an image")),
            }
        }
        Ok(())
    }

    fn path(&mut self, path: &usvg::Path, at: Transform, opacity: f32) -> Result<(), FigureError> {
        if !path.is_visible() || path.fill().is_none() && path.stroke().is_none() {
            return Ok(());
        }
        let of = |own: Option<f32>| own.map_or(1.0, |own| own * opacity);
        let alphas = (
            of(path.fill().map(|f| f.opacity().get())),
            of(path.stroke().map(|s| s.opacity().get())),
        );
        if opacity < 1.0 && path.fill().is_some() && path.stroke().is_some() {
            return Err(unknown("an area with an outline that something shines through"));
        }
        self.content.save_state();
        if alphas != (1.0, 1.0) {
            let count = self.opacities.len();
            let bits = (alphas.0.to_bits(), alphas.1.to_bits());
            let name = self.opacities.entry(bits).or_insert_with(|| format!("o{count}"));
            self.content.set_parameters(Name(name.as_bytes()));
        }
        if let Some(fill) = path.fill() {
            let [r, g, b] = colour(fill.paint())?;
            self.content.set_fill_rgb(r, g, b);
        }
        if let Some(stroke) = path.stroke() {
            self.pen(stroke, (at.sx * at.sy - at.kx * at.ky).abs().sqrt())?;
        }
        self.outline(path.data(), at);
        let is_even_odd = path.fill().is_some_and(|f| f.rule() == usvg::FillRule::EvenOdd);
        match (path.fill().is_some(), path.stroke().is_some()) {
            (true, false) if is_even_odd => self.content.fill_even_odd(),
            (true, false) => self.content.fill_nonzero(),
            (true, true) if is_even_odd => self.content.fill_even_odd_and_stroke(),
            (true, true) => self.content.fill_nonzero_and_stroke(),
            _ => self.content.stroke(),
        };
        self.content.restore_state();
        Ok(())
    }

    /// Colour, width and pattern of a line; `scale`: lengths on the page over lengths of the shape.
    fn pen(&mut self, stroke: &usvg::Stroke, scale: f32) -> Result<(), FigureError> {
        let [r, g, b] = colour(stroke.paint())?;
        self.content.set_stroke_rgb(r, g, b);
        self.content.set_line_width(stroke.width().get() * scale);
        self.content.set_miter_limit(stroke.miterlimit().get());
        self.content.set_line_cap(match stroke.linecap() {
            usvg::LineCap::Butt => LineCapStyle::ButtCap,
            usvg::LineCap::Round => LineCapStyle::RoundCap,
            usvg::LineCap::Square => LineCapStyle::ProjectingSquareCap,
        });
        self.content.set_line_join(match stroke.linejoin() {
            usvg::LineJoin::Miter | usvg::LineJoin::MiterClip => LineJoinStyle::MiterJoin,
            usvg::LineJoin::Round => LineJoinStyle::RoundJoin,
            usvg::LineJoin::Bevel => LineJoinStyle::BevelJoin,
        });
        if let Some(dashes) = stroke.dasharray() {
            let lengths = dashes.iter().map(|d| d * scale);
            self.content.set_dash_pattern(lengths, stroke.dashoffset() * scale);
        }
        Ok(())
    }

    /// Lines and curves on the page.
    fn outline(&mut self, data: &resvg::tiny_skia::Path, at: Transform) {
        let on_page = |mut p: Point| {
            at.map_point(&mut p);
            p
        };
        let mut here = Point::zero();
        for segment in data.segments() {
            here = match segment {
                PathSegment::MoveTo(p) => {
                    let p = on_page(p);
                    self.content.move_to(p.x, p.y);
                    p
                }
                PathSegment::LineTo(p) => {
                    let p = on_page(p);
                    self.content.line_to(p.x, p.y);
                    p
                }
                // PDF has cubic curves only
                PathSegment::QuadTo(c, p) => {
                    let (c, p) = (on_page(c), on_page(p));
                    let towards = |end: Point| {
                        (end.x + (c.x - end.x) * 2.0 / 3.0, end.y + (c.y - end.y) * 2.0 / 3.0)
                    };
                    let (a, b) = (towards(here), towards(p));
                    self.content.cubic_to(a.0, a.1, b.0, b.1, p.x, p.y);
                    p
                }
                PathSegment::CubicTo(a, b, p) => {
                    let (a, b, p) = (on_page(a), on_page(b), on_page(p));
                    self.content.cubic_to(a.x, a.y, b.x, b.y, p.x, p.y);
                    p
                }
                PathSegment::Close => {
                    self.content.close_path();
                    here
                }
            };
        }
    }
}
