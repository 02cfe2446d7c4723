//! The assembled body: `M ü + C u̇ + K u = f + contact`, prescribed displacements eliminated.

use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::FemError;
use super::discrete::{Discrete, with_elements};
use super::dofs::{ContactRows, DofMap};
use super::eigen;
use super::element::{ElementMatrices, MassForm, Shape};
use super::factor::SpdFactor;
use super::law::Material;
use super::massless;
use super::reduction::Reduction;
use super::sparse::{Csr, Sums};
use crate::mesh::{Element, Mesh, Point, bounds, structured};

/// Where the matrices come from.
#[derive(Debug, Clone, PartialEq)]
pub enum Origin {
    /// Assembled from elements; one material a region of the mesh.
    Elements(Vec<Material>),
    /// Given: no shape, no materials. The lowest frequency, and a bound of all.
    Matrices {
        /// Lowest circular frequency but zero.
        lowest: f64,
        /// Bound of all.
        highest: f64,
        /// Displacements over the rows that the stiffness does not oppose.
        free: Vec<Vec<f64>>,
    },
    /// Of a body of elements, in fewer coordinates.
    Reduced {
        /// Its materials.
        materials: Vec<Material>,
        /// Bound of all frequencies that are left.
        highest: f64,
        /// From the coordinates to the displacements.
        reduction: Arc<Reduction>,
    },
}

/// An elastic body by its matrices over `u = (u_O, u_C)`.
#[derive(Debug, Clone)]
pub struct Body {
    /// Nodes and elements; for given matrices a row of points that files and pictures can name.
    pub mesh: Mesh,
    /// Numbering of `u`.
    pub dofs: DofMap,
    /// Elements, or files.
    pub origin: Origin,
    /// Mass matrix `M`.
    pub mass: Csr,
    /// Stiffness matrix `K`.
    pub stiffness: Csr,
    /// Stiffness over `u` of the body alone, where the contact adds to it in every state: what Rayleigh's damping multiplies.
    pub structure: Option<Csr>,
    /// Springs and masses between its displacements and elsewhere; they are in the matrices.
    pub discrete: Vec<Discrete>,
    /// How the mass of the elements is spread.
    pub mass_form: MassForm,
    /// `K` and `M` of given matrices over their rows, and behind them those that supports hold, which are nodes of the mesh; where there are such.
    bordered: Option<Arc<[Csr; 2]>>,
    /// Unit translations along x, y and z of given matrices, over their rows and those that are held, where somebody knows what these are.
    translations: Option<Arc<[Vec<f64>; 3]>>,
    /// The largest eigenvalue of one of its elements by itself, where it is assembled from such.
    largest: f64,
    /// [`Body::frequency_bound`], once it was asked for.
    bound: OnceLock<f64>,
}

/// Elements whose matrices are integrated together, on all threads.
const BATCH: usize = 2048;

/// The elements whose nodes are wanted, in their order, with their matrices.
fn matrices_of<'m>(
    mesh: &'m Mesh,
    materials: &'m [Material],
    form: MassForm,
    is_wanted: impl Fn(&[usize]) -> bool + Copy + 'm,
) -> impl Iterator<Item = (Element<'m>, Arc<ElementMatrices>)> {
    made_of_matrices(mesh, materials, form, is_wanted, Arc::new)
}

/// The same with what is made of their matrices: of their own shape, or of those that all elements of a block share.
fn made_of_matrices<'m, T: Clone + Send + Sync>(
    mesh: &'m Mesh,
    materials: &'m [Material],
    form: MassForm,
    is_wanted: impl Fn(&[usize]) -> bool + Copy + 'm,
    make: impl Fn(ElementMatrices) -> T + Copy + Sync + 'm,
) -> impl Iterator<Item = (Element<'m>, T)> {
    mesh.blocks().iter().flat_map(move |block| {
        let n = block.kind.nodes();
        let element = move |nodes| Element { kind: block.kind, region: block.region, nodes };
        let of = move |nodes: &[usize]| {
            let x: Vec<Point> = nodes.iter().map(|&n| mesh.nodes()[n]).collect();
            make(Shape { kind: block.kind, x: &x }.matrices(&materials[block.region], form))
        };
        let shared = (block.congruent && block.connectivity.len() >= n)
            .then(|| of(&block.connectivity[..n]));
        block.connectivity.chunks(BATCH * n).flat_map(move |batch| {
            let wanted: Vec<&[usize]> = batch.chunks_exact(n).filter(|e| is_wanted(e)).collect();
            let made: Vec<T> = match &shared {
                Some(made) => vec![made.clone(); wanted.len()],
                None => wanted.par_iter().map(|nodes| of(nodes)).collect(),
            };
            wanted.into_iter().map(element).zip(made)
        })
    })
}

/// Whether a field over the components of all nodes moves one of these.
fn moves(w: &[f64], dim: usize, nodes: &[usize]) -> bool {
    nodes.iter().any(|n| w[dim * n..dim * (n + 1)].iter().any(|w| *w != 0.0))
}

/// The displacements of an element as combinations of entries of `u`: its own number, the entry, the factor.
fn terms_of(dofs: &DofMap, element: Element, terms: &mut Vec<(usize, usize, f64)>) {
    terms.clear();
    for (k, &node) in element.nodes.iter().enumerate() {
        for c in 0..dofs.dim {
            terms.extend(dofs.terms(node, c).map(|(i, t)| (dofs.dim * k + c, i, t)));
        }
    }
}

/// A frequency below this share of the highest is that of a motion which the stiffness does not oppose.
const FREE: f64 = 1e-7;

/// The frequencies of given matrices: the lowest but zero and the highest, and the motions that the stiffness does not oppose. Contact displacements may have no mass: they
/// follow the others, and the highest is that of the body with these held.
fn extreme_frequencies(
    mass: &Csr,
    stiffness: &Csr,
    contact: &[usize],
) -> Result<(f64, f64, Vec<Vec<f64>>), FemError> {
    let n = mass.n_rows();
    let massless: Vec<usize> =
        contact.iter().copied().filter(|&i| mass.row(i).next().is_none()).collect();
    let of = |k: &Csr, m: &Csr| -> Result<(f64, f64, Vec<Vec<f64>>), FemError> {
        let modes = eigen::all(k, m, 1e-300)?;
        let highest = modes.omega.iter().fold(0.0f64, |m, w| m.max(*w));
        let is_free = |w: &f64| *w <= FREE * highest;
        let lowest = modes.omega.iter().find(|w| !is_free(w)).copied().unwrap_or(0.0);
        let all = modes.omega.iter().zip(modes.shapes);
        let free = all.filter(|(w, _)| is_free(w)).map(|(_, shape)| shape).collect();
        Ok((lowest, highest, free))
    };
    if massless.is_empty() {
        return of(stiffness, mass);
    }
    let others: Vec<usize> = (0..n).filter(|i| !massless.contains(i)).collect();
    let block = |a: &Csr, rows: &[usize], columns: &[usize]| {
        DMatrix::from_fn(rows.len(), columns.len(), |i, j| {
            a.entry(rows[i], columns[j]).copied().unwrap_or(0.0)
        })
    };
    let sparse = |a: &DMatrix<f64>| {
        let all = (0..a.nrows()).flat_map(|i| (0..a.ncols()).map(move |j| (i, j)));
        let entries = all.map(|(i, j)| (i, j, a[(i, j)])).collect();
        Csr::from_triplets(a.nrows(), a.ncols(), entries)
    };
    let held = block(stiffness, &others, &others);
    let own = sparse(&block(mass, &others, &others));
    let (_, highest, _) = of(&sparse(&held), &own)?;
    // K_OO − K_Oz K_zz⁻¹ K_zO
    let coupling = block(stiffness, &massless, &others);
    let factor = block(stiffness, &massless, &massless)
        .cholesky()
        .ok_or(FemError::NotPositiveDefinite { what: "stiffness matrix" })?;
    let follow = -factor.solve(&coupling);
    let (lowest, _, free) = of(&sparse(&(held + coupling.transpose() * &follow)), &own)?;
    let whole = |shape: Vec<f64>| -> Vec<f64> {
        let mut all = vec![0.0; n];
        others.iter().zip(&shape).for_each(|(&i, x)| all[i] = *x);
        let followed = &follow * nalgebra::DVector::from_vec(shape);
        massless.iter().zip(followed.iter()).for_each(|(&i, x)| all[i] = *x);
        all
    };
    Ok((lowest, highest, free.into_iter().map(whole).collect()))
}

impl Body {
    /// Assemble.
    pub fn assemble(mesh: Mesh, dofs: DofMap, materials: &[Material], form: MassForm) -> Body {
        let (dim, n, lumped) = (mesh.dim(), dofs.n(), form != MassForm::Consistent);
        let mut terms = vec![];
        let mut counts = vec![0; n];
        for element in mesh.elements() {
            terms_of(&dofs, element, &mut terms);
            terms.iter().for_each(|&(_, i, _)| counts[i] += terms.len());
        }
        let mut mass = Sums::new(if lumped { vec![] } else { counts.clone() }, n);
        let mut stiffness = Sums::new(counts, n);
        let (mut diagonal, mut largest) = (vec![], 0.0f64);
        let with_largest = |matrices| (largest_eigenvalue(&matrices), Arc::new(matrices));
        let all = made_of_matrices(&mesh, materials, form, |_| true, with_largest);
        for (element, (eigenvalue, matrices)) in all {
            largest = largest.max(eigenvalue);
            let n = matrices.n;
            terms_of(&dofs, element, &mut terms);
            for &(a, i, ci) in &terms {
                for &(b, j, cj) in &terms {
                    stiffness.add(i, j, ci * cj * matrices.stiffness[n * a + b]);
                    if !lumped {
                        mass.add(i, j, ci * cj * matrices.mass[n * a + b]);
                    }
                }
            }
            for (k, &node) in element.nodes.iter().enumerate().filter(|_| lumped) {
                let of_node = matrices.mass[(n + 1) * dim * k];
                diagonal.extend(dofs.gram(node).into_iter().map(|(i, j, g)| (i, j, g * of_node)));
            }
        }
        let stiffness = stiffness.finish();
        Body {
            mass: if lumped { Csr::from_triplets(n, n, diagonal) } else { mass.finish() },
            stiffness,
            mesh,
            dofs,
            origin: Origin::Elements(materials.to_vec()),
            structure: None,
            discrete: vec![],
            mass_form: form,
            bordered: None,
            translations: None,
            largest,
            bound: OnceLock::new(),
        }
    }

    /// The body with springs and masses on its displacements.
    pub fn with_elements(self, discrete: Vec<Discrete>) -> Body {
        let mass = with_elements(self.mass, &discrete, |e| e.mass);
        let stiffness = with_elements(self.stiffness, &discrete, |e| e.stiffness);
        Body { mass, stiffness, discrete, bound: OnceLock::new(), ..self }
    }

    /// The body with `points` contact displacements that are but seen, `u_C = n u_O`: they have no rows of their own. `terms` over `u_O` come to its stiffness, and do
    /// not damp.
    pub(crate) fn with_points(self, points: usize, terms: Vec<(usize, usize, f64)>) -> Body {
        let n = self.dofs.n_o + points;
        let whole = |entries: Vec<(usize, usize, f64)>| Csr::from_triplets(n, n, entries);
        let mass = whole(self.mass.triplets().collect());
        let own: Vec<_> = self.stiffness.triplets().collect();
        let structure = (!terms.is_empty()).then(|| whole(own.clone()));
        let stiffness = whole(own.into_iter().chain(terms).collect());
        let (dofs, bound) = (self.dofs.with_points(points), OnceLock::new());
        Body { dofs, mass, stiffness, structure, bound, ..self }
    }

    /// The body with `count` more entries of `u_O`, its last ones: they have a mass of one, and nothing acts on them.
    pub fn with_memory(self, count: usize) -> Body {
        if count == 0 {
            return self;
        }
        let (n, n_o) = (self.dofs.n() + count, self.dofs.n_o);
        let place = |i: usize| if i < n_o { i } else { i + count };
        let moved = |a: &Csr| a.triplets().map(|(i, j, v)| (place(i), place(j), v)).collect();
        let mut mass: Vec<(usize, usize, f64)> = moved(&self.mass);
        mass.extend((n_o..n_o + count).map(|i| (i, i, 1.0)));
        let stiffness = Csr::from_triplets(n, n, moved(&self.stiffness));
        let mut discrete = self.discrete;
        discrete.iter_mut().flat_map(|e| &mut e.row).for_each(|(i, _)| *i = place(*i));
        let dofs = self.dofs.with_memory(count);
        let mass = Csr::from_triplets(n, n, mass);
        Body { mass, stiffness, discrete, dofs, bound: OnceLock::new(), ..self }
    }

    /// Stiffness over `u` of the body alone.
    pub fn structure(&self) -> &Csr {
        self.structure.as_ref().unwrap_or(&self.stiffness)
    }

    /// The materials of the regions; none for given matrices.
    pub fn materials(&self) -> &[Material] {
        match &self.origin {
            Origin::Elements(materials) | Origin::Reduced { materials, .. } => materials,
            Origin::Matrices { .. } => &[],
        }
    }

    /// The body in the coordinates `y` of a reduction of its `u_O`; its mesh stays for files and pictures.
    pub fn reduced(&self, reduction: Arc<Reduction>) -> Result<Body, FemError> {
        let (mass, stiffness) =
            (reduction.congruence(&self.mass), reduction.congruence(&self.stiffness));
        // what is but seen has no rows
        let of_body = |a: &Csr| match self.dofs.is_seen {
            true => a.leading(reduction.n_y()),
            false => a.clone(),
        };
        let (k, m) = (of_body(&stiffness), of_body(&mass));
        let modes = eigen::all(&k, &m, self.frequency_unit())?;
        let highest = (1.0 + 1e-9) * modes.omega.iter().fold(0.0f64, |m, w| m.max(*w));
        let materials = self.materials().to_vec();
        Ok(Body {
            structure: self.structure.as_ref().map(|k| reduction.congruence(k)),
            mesh: self.mesh.clone(),
            dofs: self.dofs.of_coordinates(reduction.n_y()),
            origin: Origin::Reduced { materials, highest, reduction },
            mass,
            stiffness,
            discrete: vec![],
            mass_form: MassForm::Consistent,
            bordered: None,
            translations: None,
            largest: 0.0,
            bound: OnceLock::new(),
        })
    }

    /// The reduction of its `u_O`, if there is one.
    pub fn reduction(&self) -> Option<&Reduction> {
        match &self.origin {
            Origin::Reduced { reduction, .. } => Some(reduction),
            _ => None,
        }
    }

    /// Numbering of the displacements of the mesh, which is that of `u` where nothing is reduced.
    pub fn nodal_dofs(&self) -> &DofMap {
        self.reduction().map_or(&self.dofs, |r| &r.dofs)
    }

    /// `u_O` of the mesh.
    pub fn nodal_o<'x>(&self, u_o: &'x [f64]) -> Cow<'x, [f64]> {
        self.reduction().map_or(Cow::Borrowed(u_o), |r| Cow::Owned(r.expand(u_o)))
    }

    /// The coordinates of a `u_O` of the mesh.
    pub fn coordinates<'x>(&self, u_o: &'x [f64]) -> Cow<'x, [f64]> {
        self.reduction().map_or(Cow::Borrowed(u_o), |r| Cow::Owned(r.project(u_o)))
    }

    /// `u = (u_O, u_C)` of the mesh.
    pub fn nodal<'x>(&self, u: &'x [f64]) -> Cow<'x, [f64]> {
        let (y, u_c) = u.split_at(self.dofs.n_o);
        let expand = |r: &Reduction| Cow::Owned([&r.expand(y)[..], u_c].concat());
        self.reduction().map_or(Cow::Borrowed(u), expand)
    }

    /// Whether there are elements to integrate over.
    fn is_of_elements(&self) -> bool {
        matches!(self.origin, Origin::Elements(_))
    }

    /// A body of given matrices. Its mesh is a row of points, one a displacement, that files and pictures can name.
    pub fn from_matrices(
        mass: &Csr,
        stiffness: &Csr,
        rows: &ContactRows,
        length: f64,
    ) -> Result<Body, FemError> {
        let n = mass.n_rows();
        let contact: Vec<usize> = rows.all().collect();
        let dofs = DofMap::of_rows(n, rows);
        let [of_mass, of_stiffness] = [mass, stiffness].map(|a| dofs.congruence(a));
        let t = massless::split(n, &rows.massless);
        let is_pivot = |i: usize| rows.massless.iter().any(|m| m.pivot == i);
        // what has no mass has none to the last digit
        let own = mass.congruence(&t);
        let own = own.triplets().filter(|e| !is_pivot(e.0) && !is_pivot(e.1)).collect();
        let own = Csr::from_triplets(n, n, own);
        let (lowest, highest, free) =
            extreme_frequencies(&own, &stiffness.congruence(&t), &contact)?;
        let over_rows = |shape: Vec<f64>| {
            let mut all = vec![0.0; n];
            t.mul(&shape, &mut all);
            all
        };
        let free = free.into_iter().map(over_rows).collect();
        if lowest <= 0.0 {
            return Err(FemError::NotPositiveDefinite { what: "stiffness matrix" });
        }
        Ok(Body {
            mass: of_mass,
            stiffness: of_stiffness,
            mesh: structured::row(length, n),
            origin: Origin::Matrices { lowest, highest: (1.0 + 1e-9) * highest, free },
            dofs,
            structure: None,
            discrete: vec![],
            mass_form: MassForm::Consistent,
            bordered: None,
            translations: None,
            largest: 0.0,
            bound: OnceLock::new(),
        })
    }

    /// The same beside rows that supports hold: `K` and `M` over the rows of the body and, behind them, those.
    pub fn with_held_rows(mut self, bordered: [Csr; 2], length: f64) -> Body {
        let all = bordered[0].n_rows();
        self.mesh = structured::row(length, all);
        self.dofs.hold_rows(all);
        self.bordered = Some(bordered.into());
        self
    }

    /// The same with the unit translations along x, y and z, over all these rows.
    pub fn with_translations(mut self, translations: [Vec<f64>; 3]) -> Body {
        self.translations = Some(translations.into());
        self
    }

    /// The forces `M Σ a_c w_c` of an acceleration on the nodes of given matrices whose translations `w_c` are known.
    pub(crate) fn pull_on_rows(&self, acceleration: &[f64]) -> Option<Vec<f64>> {
        let translations = self.translations.as_ref()?;
        let mut field = vec![0.0; self.mesh.n_nodes()];
        for (a, w) in acceleration.iter().zip(translations.iter()) {
            field.iter_mut().zip(w).for_each(|(x, w)| *x += a * w);
        }
        let [_, force] = self.products_of_field(&field);
        Some(force)
    }

    /// Masses of the rows of given matrices that supports hold: their diagonal.
    pub fn held_masses(&self) -> Vec<f64> {
        let Some(bordered) = &self.bordered else { return vec![] };
        let rows = self.dofs.n_rows()..bordered[1].n_rows();
        rows.map(|i| bordered[1].entry(i, i).copied().unwrap_or(0.0)).collect()
    }

    /// `K w` and `M w` of nodal fields of given matrices, over their rows and those that are held.
    fn bordered_products(&self, w: &[f64]) -> Option<[Vec<f64>; 2]> {
        let bordered = self.bordered.as_ref()?;
        let product = |a: &Csr| (0..a.n_rows()).map(|i| a.row_dot(i, w)).collect();
        Some([product(&bordered[0]), product(&bordered[1])])
    }

    /// `K w` and `M w` on the free displacements, of a nodal field `w` (components interleaved) that may move prescribed displacements: `K_fp w_p` for one that
    /// moves nothing else. Nothing for bodies without elements.
    pub fn forces_of_field(&self, w: &[f64]) -> [Vec<f64>; 2] {
        let (mesh, dim, form) = (&self.mesh, self.mesh.dim(), self.mass_form);
        let mut forces = [vec![0.0; self.dofs.n()], vec![0.0; self.dofs.n()]];
        if !self.is_of_elements() {
            let Some(products) = self.bordered_products(w) else { return forces };
            for (forces, product) in forces.iter_mut().zip(products) {
                for (row, f) in product.into_iter().enumerate() {
                    self.dofs.terms(row, 0).for_each(|(i, c)| forces[i] += c * f);
                }
            }
            return forces;
        }
        for (e, matrices) in matrices_of(mesh, self.materials(), form, |nodes| moves(w, dim, nodes))
        {
            let n = matrices.n;
            let of_corner = |b: usize| w[dim * e.nodes[b / dim] + b % dim];
            for a in 0..n {
                for (i, c) in self.dofs.terms(e.nodes[a / dim], a % dim) {
                    for b in 0..n {
                        forces[0][i] += c * matrices.stiffness[n * a + b] * of_corner(b);
                        forces[1][i] += c * matrices.mass[n * a + b] * of_corner(b);
                    }
                }
            }
        }
        forces
    }

    /// `K w` and `M w` on all nodes (components interleaved), held displacements included, of a nodal field `w`.
    pub(crate) fn products_of_field(&self, w: &[f64]) -> [Vec<f64>; 2] {
        let (mesh, dim, form) = (&self.mesh, self.mesh.dim(), self.mass_form);
        let mut products = [vec![0.0; w.len()], vec![0.0; w.len()]];
        if !self.is_of_elements() {
            for (own, product) in
                products.iter_mut().zip(self.bordered_products(w).into_iter().flatten())
            {
                own[..product.len()].copy_from_slice(&product);
            }
            return products;
        }
        for (e, matrices) in matrices_of(mesh, self.materials(), form, |nodes| moves(w, dim, nodes))
        {
            let n = matrices.n;
            let place = |a: usize| dim * e.nodes[a / dim] + a % dim;
            for (a, b) in (0..n).flat_map(|a| (0..n).map(move |b| (a, b))) {
                products[0][place(a)] += matrices.stiffness[n * a + b] * w[place(b)];
                products[1][place(a)] += matrices.mass[n * a + b] * w[place(b)];
            }
        }
        products
    }

    /// `w K` and `w M` over `u` of nodal fields `w` that move what is held, rows over the components of all nodes.
    pub(crate) fn rows_of_fields(&self, fields: &Csr) -> [Csr; 2] {
        let (mesh, dim, form) = (&self.mesh, self.mesh.dim(), self.mass_form);
        let shape = (fields.n_rows(), self.dofs.n());
        let at = fields.transposed();
        let mut entries = [vec![], vec![]];
        if !self.is_of_elements() {
            for (entries, a) in entries.iter_mut().zip(self.bordered.iter().flat_map(|b| b.iter()))
            {
                for (field, node, w) in fields.triplets() {
                    let row = a
                        .row(node)
                        .flat_map(|(j, v)| self.dofs.terms(j, 0).map(move |(i, c)| (i, c * v)));
                    entries.extend(row.map(|(i, v)| (field, i, w * v)));
                }
            }
            return entries.map(|e| Csr::from_triplets(shape.0, shape.1, e));
        }
        let is_known = |node: &usize| (0..dim).any(|c| at.row(dim * node + c).next().is_some());
        let is_wanted = |nodes: &[usize]| nodes.iter().any(is_known);
        for (e, matrices) in matrices_of(mesh, self.materials(), form, is_wanted) {
            let n = matrices.n;
            let place = |a: usize| dim * e.nodes[a / dim] + a % dim;
            for (a, b) in (0..n).flat_map(|a| (0..n).map(move |b| (a, b))) {
                for (i, c) in self.dofs.terms(e.nodes[a / dim], a % dim) {
                    let (k, m) = (matrices.stiffness[n * a + b], matrices.mass[n * a + b]);
                    entries[0].extend(at.row(place(b)).map(|(f, w)| (f, i, c * w * k)));
                    entries[1].extend(at.row(place(b)).map(|(f, w)| (f, i, c * w * m)));
                }
            }
        }
        entries.map(|e| Csr::from_triplets(shape.0, shape.1, e))
    }

    /// The elements that have contact nodes.
    fn elements_at_contact(&self) -> impl Iterator<Item = Element<'_>> {
        let touches = |n: &usize| self.dofs.contact.iter().any(|c| c.node == *n);
        self.mesh.elements().filter(move |e| e.nodes.iter().any(touches))
    }

    /// Whether an element with a contact node has a node where a nodal field moves what is held.
    pub fn moves_supports_at_contact(&self, w: &[f64]) -> bool {
        self.elements_at_contact().any(|e| e.nodes.iter().any(|&n| self.dofs.moves_held(n, w)))
    }

    /// Mass that belongs to each node (row sums over all shape functions).
    pub fn nodal_mass(&self) -> Vec<f64> {
        let mut mass = vec![0.0; self.mesh.n_nodes()];
        self.scalar_mass().triplets().for_each(|(i, _, m)| mass[i] += m);
        mass
    }

    /// The mass matrix of one displacement component over all nodes, prescribed ones included; empty for given matrices.
    pub fn scalar_mass(&self) -> Csr {
        let (mesh, dim, form) = (&self.mesh, self.mesh.dim(), self.mass_form);
        let mut entries = vec![];
        // of a reduced body too
        if !self.materials().is_empty() {
            for (e, matrices) in matrices_of(mesh, self.materials(), form, |_| true) {
                for (a, &i) in e.nodes.iter().enumerate() {
                    for (b, &j) in e.nodes.iter().enumerate() {
                        let v = matrices.mass[matrices.n * dim * a + dim * b];
                        entries.push((i, j, v));
                    }
                }
            }
        }
        Csr::from_triplets(mesh.n_nodes(), mesh.n_nodes(), entries)
    }

    /// Natural unit of circular frequency: that of a quarter wave over the body's length; of given matrices the lowest.
    pub fn frequency_unit(&self) -> f64 {
        match &self.origin {
            Origin::Matrices { lowest, .. } => *lowest,
            Origin::Elements(materials) | Origin::Reduced { materials, .. } => {
                let speed = materials.iter().map(Material::wave_speed).fold(0.0, f64::max);
                std::f64::consts::FRAC_PI_2 * speed / self.mesh.length()
            }
        }
    }

    /// Speed of pressure waves; none for given matrices.
    pub fn wave_speed(&self) -> Option<f64> {
        self.materials().iter().map(Material::wave_speed).reduce(f64::max)
    }

    /// Median size along the contact normal of the elements that have contact nodes; none for given matrices.
    pub fn size_at_contact(&self) -> Option<f64> {
        let size = |e: Element| {
            let point = self.dofs.contact.iter().find(|c| e.nodes.contains(&c.node));
            point.map_or(0.0, |c| self.mesh.extent(e, c.direction))
        };
        let mut sizes: Vec<f64> = self.elements_at_contact().map(size).collect();
        sizes.sort_by(f64::total_cmp);
        sizes.get(sizes.len() / 2).copied().filter(|_| !self.materials().is_empty())
    }

    /// Upper bound of the natural frequencies of the body and of all phases of the paper's mass: the largest natural frequency of an
    /// element by itself (Irons; supports and contact conditions only take motions away), and what springs add to its square, `k wᵀM⁻¹w` at the most.
    pub fn frequency_bound(&self) -> f64 {
        *self.bound.get_or_init(|| self.bound_by_elements())
    }

    fn bound_by_elements(&self) -> f64 {
        match &self.origin {
            Origin::Matrices { highest, .. } | Origin::Reduced { highest, .. } => *highest,
            Origin::Elements(_) => (1.0 + 1e-9) * (self.largest + self.of_springs()).sqrt(),
        }
    }

    /// `Σ k wᵀM⁻¹w`
    fn of_springs(&self) -> f64 {
        let mut springs = self.discrete.iter().filter(|e| e.stiffness != 0.0).peekable();
        if springs.peek().is_none() {
            return 0.0;
        }
        let Ok(factor) = SpdFactor::new(&self.mass, "mass matrix") else { return f64::INFINITY };
        let mut scratch = factor.scratch();
        let of_one = |spring: &Discrete| {
            let mut x = vec![0.0; self.dofs.n()];
            spring.row.iter().for_each(|&(j, w)| x[j] = w);
            factor.solve(&mut x, &mut scratch);
            spring.stiffness * spring.along(&x)
        };
        springs.map(of_one).sum()
    }

    /// Motions that supports and springs leave without any force, as nodal fields: rigid ones of a body of elements. `held_contact` counts the contact displacements as prescribed
    /// too.
    pub fn rigid_motions(&self, held_contact: bool) -> Vec<Vec<f64>> {
        match &self.origin {
            Origin::Elements(_) => self.rigid_motions_of_elements(held_contact),
            Origin::Matrices { free, .. } if !free.is_empty() => {
                self.free_motions(free, held_contact)
            }
            Origin::Matrices { .. } => vec![],
            // what is left of a body that was looked at before
            Origin::Reduced { .. } => vec![],
        }
    }

    /// The motions over the rows of given matrices that no stiffness opposes, as values at the points that stand for the rows.
    fn free_motions(&self, free: &[Vec<f64>], held_contact: bool) -> Vec<Vec<f64>> {
        let at_contact = self.dofs.contact.iter().filter(|_| held_contact);
        let rows: Vec<usize> = at_contact.map(|c| c.node).collect();
        let gram = DMatrix::from_fn(free.len(), free.len(), |a, b| {
            rows.iter().map(|&i| free[a][i] * free[b][i]).sum()
        });
        let size = free.iter().flatten().fold(0.0f64, |m, x| m.max(x * x));
        let combined = |v: &[f64]| -> Vec<f64> {
            let of_row = |i: usize| v.iter().zip(free).map(|(v, f)| v * f[i]).sum();
            // what is held stands still, and so does the ground, the last point
            let rows = free.first().map_or(0, Vec::len);
            let still = std::iter::repeat_n(0.0, self.mesh.n_nodes() - rows);
            (0..rows).map(of_row).chain(still).collect()
        };
        let eigen = gram.symmetric_eigen();
        (0..free.len())
            .filter(|&k| eigen.eigenvalues[k] <= 1e-10 * size)
            .map(|k| combined(eigen.eigenvectors.column(k).as_slice()))
            .collect()
    }

    fn rigid_motions_of_elements(&self, held_contact: bool) -> Vec<Vec<f64>> {
        let (mesh, dofs, dim) = (&self.mesh, &self.dofs, self.mesh.dim());
        let part_of = mesh.parts();
        let n_parts = part_of.iter().max().map_or(0, |last| last + 1);
        let frames: Vec<(f64, Point)> = (0..n_parts)
            .map(|part| {
                let own = mesh.nodes().iter().zip(&part_of).filter(|(_, p)| **p == part);
                let [low, high] = bounds(own.map(|(x, _)| x));
                let size: Point = std::array::from_fn(|c| high[c] - low[c]);
                let centre = std::array::from_fn(|c| low[c] + size[c] / 2.0);
                (size.into_iter().fold(0.0, f64::max), centre)
            })
            .collect();
        // a ring can only move along its axis
        let is_ring = self.materials().iter().any(Material::is_radial);
        // translations, then rotations in the planes of two axes
        const PLANES: [(usize, usize); 3] = [(0, 1), (1, 2), (2, 0)];
        let of_part = if is_ring { 1 } else { dim * (dim + 1) / 2 };
        let n_motions = of_part * n_parts;
        // motion k of a node; a part moves by itself
        let motion = |k: usize, n: usize, c: usize| {
            if k / of_part != part_of[n] {
                return 0.0;
            }
            let (p, (scale, centre)) = (mesh.nodes()[n], frames[part_of[n]]);
            let k = k % of_part;
            match k.checked_sub(dim) {
                _ if is_ring => c as f64,
                None => f64::from(u8::from(c == k)),
                Some(plane) => match PLANES[plane] {
                    (a, b) if c == a => -(p[b] - centre[b]) / scale,
                    (a, b) if c == b => (p[a] - centre[a]) / scale,
                    _ => 0.0,
                },
            }
        };
        let mut gram = nalgebra::DMatrix::<f64>::zeros(n_motions, n_motions);
        let mut held = 0.0f64;
        let mut hold = |along: Vec<f64>| {
            held += 1.0;
            let moved: Vec<usize> = (0..n_motions).filter(|&k| along[k] != 0.0).collect();
            for &a in &moved {
                moved.iter().for_each(|&b| gram[(a, b)] += along[a] * along[b]);
            }
        };
        let along = |n: usize, d: Point| -> Vec<f64> {
            (0..n_motions).map(|k| (0..dim).map(|c| d[c] * motion(k, n, c)).sum()).collect()
        };
        for n in 0..mesh.n_nodes() {
            dofs.directions(n).filter(|d| d.1.is_none()).for_each(|d| hold(along(n, d.0)));
        }
        // contact displacements, whether they are u_C or carry springs, against those of what they meet
        for (i, c) in dofs.contact[..dofs.n_facing].iter().enumerate().filter(|_| held_contact) {
            let mut own = along(c.node, c.direction);
            for (j, p) in dofs.against(i) {
                own.iter_mut().zip(along(*j, c.direction)).for_each(|(a, b)| *a -= p * b);
            }
            hold(own);
        }
        for spring in self.discrete.iter().filter(|e| e.stiffness != 0.0) {
            let of_motion = |k: usize| {
                let nodes = 0..mesh.n_nodes();
                let field = nodes.flat_map(|n| (0..dim).map(move |c| (n, c)));
                let field: Vec<f64> = field.map(|(n, c)| motion(k, n, c)).collect();
                spring.along(&dofs.gather(&field))
            };
            hold((0..n_motions).map(of_motion).collect());
        }
        let eigen = gram.symmetric_eigen();
        (0..n_motions)
            .filter(|&k| eigen.eigenvalues[k] <= 1e-10 * held.max(1.0))
            .map(|k| {
                let v = eigen.eigenvectors.column(k);
                let field = |n: usize, c: usize| {
                    (0..n_motions).map(|a| v[a] * motion(a, n, c)).sum::<f64>()
                };
                (0..mesh.n_nodes()).flat_map(|n| (0..dim).map(move |c| field(n, c))).collect()
            })
            .collect()
    }
}

/// The largest eigenvalue of an element's stiffness against its mass.
fn largest_eigenvalue(e: &ElementMatrices) -> f64 {
    let n = e.n;
    let mass = nalgebra::DMatrix::from_row_slice(n, n, &e.mass);
    let stiffness = nalgebra::DMatrix::from_row_slice(n, n, &e.stiffness);
    // a consistent mass is positive definite
    let Some(l) = mass.cholesky().map(|c| c.l()) else { return f64::INFINITY };
    let half = l.solve_lower_triangular(&stiffness).map(|m| m.transpose());
    let reduced = half.and_then(|m| l.solve_lower_triangular(&m));
    reduced.map_or(f64::INFINITY, |m| m.symmetric_eigen().eigenvalues.max()).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::super::frame::{Facing, Held};
    use super::*;

    fn plate(fixed: &[(&str, usize)], form: MassForm) -> Body {
        let mesh = structured::rectangle(2.0, 1.0, 6, 4);
        let held: Vec<Held> = fixed.iter().map(|(edge, axis)| Held::along(edge, *axis)).collect();
        let dofs = DofMap::new(&mesh, &held, &[Facing::surface("right")]).unwrap();
        Body::assemble(mesh, dofs, &[Material::plate(1.0, 0.3, 1.0, 1.0)], form)
    }

    #[test]
    fn rigid_motions_are_found_and_carry_no_force() {
        let free = plate(&[], MassForm::Consistent);
        assert_eq!(free.rigid_motions(false).len(), 3);
        for r in free.rigid_motions(false) {
            let u = free.dofs.gather(&r);
            let mut f = vec![0.0; u.len()];
            free.stiffness.mul(&u, &mut f);
            assert!(f.iter().all(|f| f.abs() < 1e-13));
        }
        assert_eq!(free.rigid_motions(true).len(), 1); // sliding along the obstacle
        assert_eq!(plate(&[("bottom", 1)], MassForm::Consistent).rigid_motions(false).len(), 1);
        assert_eq!(plate(&[("bottom", 1)], MassForm::Consistent).rigid_motions(true).len(), 0);
        assert_eq!(plate(&[("left", 0)], MassForm::Consistent).rigid_motions(false).len(), 1);
        assert_eq!(
            plate(&[("left", 0), ("left", 1)], MassForm::Consistent).rigid_motions(false).len(),
            0
        );
    }

    /// The bound is kept: springs that come after it was asked for raise it, above the highest frequency of the matrices.
    #[test]
    fn the_bound_of_frequencies_knows_springs_that_come_later() {
        let body = plate(&[("left", 0), ("left", 1)], MassForm::Lumped);
        let before = body.frequency_bound();
        let spring = Discrete { row: vec![(0, 1.0)], stiffness: 1e4, mass: 0.0 };
        let body = body.with_elements(vec![spring]);
        let m = body.mass.as_diagonal().unwrap();
        let mut a = nalgebra::DMatrix::zeros(m.len(), m.len());
        body.stiffness.triplets().for_each(|(i, j, v)| a[(i, j)] = v / (m[i] * m[j]).sqrt());
        let highest = a.symmetric_eigenvalues().max().sqrt();
        let bound = body.frequency_bound();
        assert!(highest > 2.0 * before && bound >= highest, "{before} {highest} {bound}");
        assert!(bound < 1.1 * highest, "{highest} {bound}");
        // once for all that asks
        assert_eq!(body.clone().bound.get(), Some(&bound));
    }

    /// Rows of a uniform mesh are sums of the same numbers in the same order, however fine it is: their products need not read them.
    #[test]
    fn rows_of_uniform_meshes_repeat() {
        for (nx, ny) in [(40, 20), (333, 111)] {
            let mesh = structured::rectangle(1.0, 0.5, nx, ny);
            let held = [Held::along("left", 0), Held::along("left", 1)];
            let dofs = DofMap::new(&mesh, &held, &[Facing::surface("right")]).unwrap();
            let body = Body::assemble(
                mesh,
                dofs,
                &[Material::plate(1.0, 0.3, 1.0, 1.0)],
                MassForm::Lumped,
            );
            let inner = ((nx - 3) * (ny - 1)) as f64 / (nx * (ny + 1)) as f64;
            let share = crate::fem::Kernel::new(&body.stiffness, 1, &[]).repeating();
            assert!(share > inner - 1e-9 || ny < 24 && share == 0.0, "{nx} x {ny}: {share}");
        }
    }

    #[test]
    fn mass_adds_up_lumped_and_consistent() {
        for form in [MassForm::Consistent, MassForm::Lumped, MassForm::ScaledDiagonal] {
            let b = plate(&[], form);
            let ones = vec![1.0; b.dofs.n()];
            assert!((b.mass.quadratic(&ones) - 2.0 * 2.0).abs() < 1e-13);
        }
        assert!(
            (plate(&[], MassForm::Consistent).nodal_mass().iter().sum::<f64>() - 2.0).abs() < 1e-13
        );
    }
}
