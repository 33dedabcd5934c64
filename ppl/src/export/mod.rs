//! Export of posteriors: a Zarr store for ArviZ, and CSV.

mod zarr;

use std::io;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::judgement::summary::Summary;
use crate::posterior::Posterior;
use crate::quantity::draws::{Group, Values};
use zarr::{ZarrArray, ZarrStore};

impl Posterior {
    /// Writes a Zarr v3 store that current ArviZ opens without conversion:
    /// `arviz.from_zarr("posterior.zarr")`.
    ///
    /// The groups are `posterior` (parameters and tracked quantities), `unconstrained_posterior`, `sample_stats`,
    /// `posterior_predictive`, `log_likelihood`, `log_prior`, `observed_data`, `prior` and `prior_predictive`. The
    /// dimensions are `chain`, `draw`, and the dimensions of the quantity, named by `#[dims(…)]` or else
    /// `<name>_dim_0`, …. Labels from the model or from [`Posterior::label`] become coordinates. Units from
    /// [`Posterior::set_units`] become the attribute `units`: a text, or a list along the last dimension. An existing
    /// store at `path` is replaced.
    ///
    /// # Errors
    /// An error of the file system, or an error if `path` exists and is not a Zarr store. The message contains the
    /// path.
    pub fn write_zarr(&self, path: impl AsRef<Path>) -> io::Result<()> {
        let path = path.as_ref();
        zarr::replace(path, |temporary| self.write_store(temporary))
            .map_err(|error| named(path, error))
    }

    fn write_store(&self, path: &Path) -> io::Result<()> {
        let mut store = ZarrStore::create(path)?;
        self.write_group(&mut store, "posterior", &self.posterior)?;
        self.write_unconstrained(&mut store)?;
        self.write_statistics(&mut store)?;
        let optional = [
            ("posterior_predictive", Some(&self.predictive)),
            ("log_likelihood", Some(&self.log_likelihood)),
            ("log_prior", Some(&self.log_prior)),
            ("prior", self.prior.as_ref()),
            ("prior_predictive", self.prior_predictive.as_ref()),
        ];
        for (name, group) in optional {
            if let Some(group) = group.filter(|group| !group.variables.is_empty()) {
                self.write_group(&mut store, name, group)?;
            }
        }
        if !self.observed.variables.is_empty() {
            store.group("observed_data")?;
            for values in &self.observed.variables {
                let dims = self.dims(&values.name);
                self.write_values(&mut store, "observed_data", values, &[], dims)?;
            }
        }
        store.finish()
    }

    /// Names of the dimensions of a quantity.
    fn dims(&self, name: &str) -> &[String] {
        let variable = self.layout.variables.iter().find(|v| v.name == name);
        variable.map_or(&[], |v| &v.dims)
    }

    fn write_group(&self, store: &mut ZarrStore, name: &str, group: &Group) -> io::Result<()> {
        store.group(name)?;
        write_chain_and_draw(store, name, group.chains, group.draws)?;
        for values in &group.variables {
            let leading = [("chain", group.chains), ("draw", group.draws)];
            self.write_values(store, name, values, &leading, self.dims(&values.name))?;
        }
        Ok(())
    }

    /// Writes one quantity, and one coordinate array for each dimension of its values (other than chain and draw).
    fn write_values(
        &self,
        store: &mut ZarrStore,
        group: &str,
        values: &Values,
        leading: &[(&str, usize)],
        names: &[String],
    ) -> io::Result<()> {
        let mut dimensions: Vec<(String, usize)> =
            leading.iter().map(|&(name, size)| (name.to_owned(), size)).collect();
        for (name, &size) in names.iter().zip(&values.shape) {
            let labels = self.layout.coordinates.get(name);
            let coordinate = match labels.filter(|labels| labels.len() == size) {
                Some(labels) => labelled(labels),
                None => ZarrArray::Integer((0..size as i64).collect()),
            };
            store.array(group, name, &[(name.clone(), size)], coordinate)?;
            dimensions.push((name.clone(), size));
        }
        let data = ZarrArray::Real(values.data.clone());
        store.described(
            group,
            &values.name,
            &dimensions,
            data,
            self.attributes(group, &values.name),
        )
    }

    /// Returns the attribute `units`: one text, or a list with one text per entry along the last dimension. Log
    /// densities have no units.
    fn attributes(&self, group: &str, name: &str) -> Value {
        let units = self.layout.units.get(name).filter(|_| !group.starts_with("log_"));
        match units.map(Vec::as_slice) {
            None | Some([]) => json!({}),
            Some([one]) => json!({ "units": one }),
            Some(all) => json!({ "units": all }),
        }
    }

    fn write_unconstrained(&self, store: &mut ZarrStore) -> io::Result<()> {
        const GROUP: &str = "unconstrained_posterior";
        let chains = &self.chains;
        let (count, draws) = (chains.chains.len(), chains.len());
        store.group(GROUP)?;
        write_chain_and_draw(store, GROUP, count, draws)?;
        let data = chains.chains.iter().flat_map(|c| &c.draws[..draws * chains.dim]).copied();
        let values = Values { name: "y".into(), shape: vec![chains.dim], data: data.collect() };
        // the dimension name is given here, because `y` is not a quantity of the model
        let leading = [("chain", count), ("draw", draws)];
        self.write_values(store, GROUP, &values, &leading, &["coordinate".to_owned()])
    }

    fn write_statistics(&self, store: &mut ZarrStore) -> io::Result<()> {
        const GROUP: &str = "sample_stats";
        let (count, draws) = (self.chains.chains.len(), self.chains.len());
        store.group(GROUP)?;
        write_chain_and_draw(store, GROUP, count, draws)?;
        let stats = || self.chains.chains.iter().flat_map(|chain| &chain.stats[..draws]);
        // ArviZ's schema defines these column names
        let columns = [
            ("lp", ZarrArray::Real(stats().map(|s| s.log_density).collect())),
            ("energy", ZarrArray::Real(stats().map(|s| s.energy).collect())),
            ("acceptance_rate", ZarrArray::Real(stats().map(|s| s.acceptance).collect())),
            ("step_size", ZarrArray::Real(stats().map(|s| s.step_size).collect())),
            ("tree_depth", ZarrArray::Integer(stats().map(|s| i64::from(s.depth)).collect())),
            ("n_steps", ZarrArray::Integer(stats().map(|s| i64::from(s.leapfrogs)).collect())),
            ("diverging", ZarrArray::Flag(stats().map(|s| s.divergent).collect())),
        ];
        let dimensions = [("chain".to_owned(), count), ("draw".to_owned(), draws)];
        for (name, column) in columns {
            store.array(GROUP, name, &dimensions, column)?;
        }
        Ok(())
    }

    /// Writes a CSV file with one row per draw: `chain`, `draw`, and one column per number of every parameter and
    /// tracked quantity, such as `young` or `sd[0]`.
    ///
    /// # Errors
    /// An error of the file system, whose message contains the path.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> io::Result<()> {
        let path = path.as_ref();
        self.write_draws(path).map_err(|error| named(path, error))
    }

    fn write_draws(&self, path: &Path) -> io::Result<()> {
        let group = &self.posterior;
        let mut writer = csv::Writer::from_path(path)?;
        let names = group.variables.iter().flat_map(Values::elements);
        writer.write_record(["chain".into(), "draw".into()].into_iter().chain(names))?;
        for row in 0..group.chains * group.draws {
            let indices = [row / group.draws, row % group.draws].map(|i| i.to_string());
            let values = group.variables.iter().flat_map(|v| {
                let size = v.size();
                v.data[row * size..(row + 1) * size].iter().map(f64::to_string)
            });
            writer.write_record(indices.into_iter().chain(values))?;
        }
        writer.flush()
    }
}

impl Summary {
    /// Writes the rows as CSV with the header
    /// `parameter,mean,sd,q05,q50,q95,rhat,ess_bulk,ess_tail,contraction,mcse_mean`.
    ///
    /// # Errors
    /// An error of the file system, whose message contains the path.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> io::Result<()> {
        let path = path.as_ref();
        let write = || {
            let mut writer = csv::Writer::from_path(path)?;
            for row in &self.rows {
                writer.serialize(row)?;
            }
            writer.flush()
        };
        write().map_err(|error| named(path, error))
    }
}

/// Error of a file that could not be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}: {source}", path.display())]
struct Unwritten {
    path: PathBuf,
    source: io::Error,
}

/// Adds the path to the message of an error, and keeps the error as the source.
fn named(path: &Path, source: io::Error) -> io::Error {
    io::Error::new(source.kind(), Unwritten { path: path.to_owned(), source })
}

/// Converts labels to integers if all labels are integers, otherwise to text.
fn labelled(labels: &[String]) -> ZarrArray {
    let integers: Result<_, _> = labels.iter().map(|label| label.parse()).collect();
    integers.map_or_else(|_| ZarrArray::Text(labels.to_vec()), ZarrArray::Integer)
}

fn write_chain_and_draw(
    store: &mut ZarrStore,
    group: &str,
    chains: usize,
    draws: usize,
) -> io::Result<()> {
    for (name, size) in [("chain", chains), ("draw", draws)] {
        let count = ZarrArray::Integer((0..size as i64).collect());
        store.array(group, name, &[(name.to_owned(), size)], count)?;
    }
    Ok(())
}
