//! Matrices of numbers, as the programs write them.

use serde::Deserialize;

use crate::error::ImportError;

/// Matrix or vector.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub(crate) enum Matrix {
    /// Its numbers by rows.
    Flat(Vec<f64>),
    /// Its rows.
    Rows(Vec<Vec<f64>>),
    /// That of ROS and of OpenCV: its numbers by rows beside its size.
    Sized {
        /// Number of rows.
        rows: usize,
        /// Number of columns.
        cols: usize,
        /// The numbers.
        data: Vec<f64>,
    },
}

impl Matrix {
    /// Returns the numbers by rows.
    ///
    /// # Errors
    /// If their count is not that of rows and columns.
    pub(crate) fn numbers(&self, name: &str) -> Result<Vec<f64>, ImportError> {
        match self {
            Self::Flat(numbers) => Ok(numbers.clone()),
            Self::Rows(rows) => Ok(rows.concat()),
            Self::Sized { rows, cols, data } if rows.checked_mul(*cols) == Some(data.len()) => {
                Ok(data.clone())
            }
            Self::Sized { rows, cols, data } => Err(ImportError::Matrix {
                name: name.to_owned(),
                wanted: format!("{rows} x {cols}"),
                count: data.len(),
            }),
        }
    }

    /// Returns the focal lengths and the principal point of a camera matrix, pixels: fx, fy, cx,
    /// cy.
    ///
    /// # Errors
    /// If it has another size than 3 x 3, or pixels that are skew.
    pub(crate) fn pinhole(&self, name: &str) -> Result<[f64; 4], ImportError> {
        let numbers = self.numbers(name)?;
        let [fx, skew, cx, zero, fy, cy, _, _, _] = numbers[..] else {
            return Err(ImportError::Matrix {
                name: name.to_owned(),
                wanted: "3 x 3".to_owned(),
                count: numbers.len(),
            });
        };
        if skew != 0.0 || zero != 0.0 {
            return Err(ImportError::Skew { name: name.to_owned(), skew });
        }
        Ok([fx, fy, cx, cy])
    }
}
