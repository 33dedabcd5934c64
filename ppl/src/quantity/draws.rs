//! Named draws with shapes.

/// Draws of one named quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Values {
    /// Name of the quantity in the model.
    pub name: String,
    /// Dimensions of one draw; empty for a scalar.
    pub shape: Vec<usize>,
    /// Draws in the order `[chain][draw][element]`; the elements of a draw are row-major.
    pub data: Vec<f64>,
}

impl Values {
    /// Number of elements in one draw.
    pub fn size(&self) -> usize {
        self.shape.iter().product()
    }

    /// Names of the elements: `young`, or `sd[0]`, `sd[1]`, …, or `chol[0,0]`, `chol[0,1]`, …
    pub fn elements(&self) -> Vec<String> {
        element_names(&self.name, &self.shape)
    }
}

/// Draws of several quantities from the same chains.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Group {
    /// Number of chains.
    pub chains: usize,
    /// Number of draws per chain.
    pub draws: usize,
    /// One entry per quantity, in the order of the model's statements.
    pub variables: Vec<Values>,
}

impl Group {
    /// Returns the draws of the named quantity; `None` if the group has no quantity with this name.
    pub fn get(&self, name: &str) -> Option<&Values> {
        self.variables.iter().find(|v| v.name == name)
    }

    /// Returns the trace of the element with the given name, such as `young` or `sd[0]`: one vector of draws per
    /// chain.
    pub fn trace(&self, element: &str) -> Option<Vec<Vec<f64>>> {
        let name = element.split('[').next().unwrap_or(element);
        let values = self.get(name)?;
        let index = values.elements().iter().position(|e| e == element)?;
        Some(self.trace_of(values, index))
    }

    /// Names and traces of all elements; a trace has one vector per chain.
    pub fn traces(&self) -> impl Iterator<Item = (String, Vec<Vec<f64>>)> {
        self.variables.iter().flat_map(move |values| self.traces_in(values))
    }

    /// Names and traces of the elements of one quantity.
    pub(crate) fn traces_in<'g>(
        &'g self,
        values: &'g Values,
    ) -> impl Iterator<Item = (String, Vec<Vec<f64>>)> + 'g {
        let names = values.elements().into_iter().enumerate();
        names.map(move |(index, name)| (name, self.trace_of(values, index)))
    }

    fn trace_of(&self, values: &Values, index: usize) -> Vec<Vec<f64>> {
        let size = values.size();
        let at =
            |chain: usize, draw: usize| values.data[(chain * self.draws + draw) * size + index];
        (0..self.chains).map(|c| (0..self.draws).map(|d| at(c, d)).collect()).collect()
    }

    /// Returns the draws of element `index` of a quantity, with the chains concatenated.
    pub(crate) fn column(&self, values: &Values, index: usize) -> Vec<f64> {
        values.data[index..].iter().step_by(values.size()).copied().collect()
    }
}

pub(crate) fn element_names(name: &str, shape: &[usize]) -> Vec<String> {
    labelled_names(name, shape, |_, index| index.to_string())
}

/// Returns the names of all elements of a quantity. `label(dimension, index)` is the text for an index along a
/// dimension.
pub(crate) fn labelled_names(
    name: &str,
    shape: &[usize],
    label: impl Fn(usize, usize) -> String,
) -> Vec<String> {
    if shape.is_empty() {
        return vec![name.to_owned()];
    }
    let size = shape.iter().product();
    (0..size)
        .map(|flat: usize| {
            let mut rest = flat;
            let mut index: Vec<String> = (0..shape.len())
                .rev()
                .map(|dimension| {
                    let i = rest % shape[dimension];
                    rest /= shape[dimension];
                    label(dimension, i)
                })
                .collect();
            index.reverse();
            format!("{name}[{}]", index.join(","))
        })
        .collect()
}
