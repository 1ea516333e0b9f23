//! Alias tables: sampling of a discrete distribution in constant time (Walker, 1977; construction
//! by Vose, 1991). They choose lights by power, and texels of environment maps.

/// Row of an alias table; row i belongs to weight i. A lookup draws a row i and a random 32-bit
/// word; it returns i if the word is below `threshold`, else `alias`. A full row has `alias` = i.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// Probability of the row's own index, in units of 2⁻³².
    pub threshold: u32,
    /// Index that shares the row.
    pub alias: u32,
}

/// Returns the table for `weights`, which are finite and not negative, with one row for each.
/// Returns `None` if the sum of the weights is 0 or not finite.
///
/// Each index has the probability of its share of the sum, within about 2⁻³²: each of the n rows
/// adds an error of at most 2⁻³² / n. An index of weight zero is never returned.
pub fn table(weights: &[f64]) -> Option<Vec<Row>> {
    let sum: f64 = weights.iter().sum();
    if !(sum > 0.0 && sum.is_finite()) {
        return None;
    }
    let scale = weights.len() as f64 / sum;
    let mut left: Vec<f64> = weights.iter().map(|weight| weight * scale).collect();
    let mut rows: Vec<Row> =
        (0u32..).take(weights.len()).map(|i| Row { threshold: u32::MAX, alias: i }).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..left.len()).partition(|&i| left[i] < 1.0);
    while let (Some(&giver), Some(taker)) = (large.last(), small.pop()) {
        let threshold = (left[taker] * 4_294_967_296.0) as u32;
        rows[taker] = Row { threshold, alias: giver as u32 };
        left[giver] -= 1.0 - left[taker];
        if left[giver] < 1.0 {
            large.pop();
            small.push(giver);
        }
    }
    // Rounding leaves some rows without a partner. Their own entry keeps the whole row, unless it
    // has weight zero and must never be returned.
    let heaviest = (0..weights.len()).max_by(|&a, &b| weights[a].total_cmp(&weights[b])).unwrap_or(0);
    for i in small {
        if weights[i] == 0.0 {
            rows[i] = Row { threshold: 0, alias: heaviest as u32 };
        }
    }
    Some(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the probability that a table gives each entry.
    fn chances(rows: &[Row]) -> Vec<f64> {
        let mut chances = vec![0.0; rows.len()];
        for (i, row) in rows.iter().enumerate() {
            let keep = if row.alias as usize == i { 1.0 } else { f64::from(row.threshold) / 4_294_967_296.0 };
            chances[i] += keep / rows.len() as f64;
            chances[row.alias as usize] += (1.0 - keep) / rows.len() as f64;
        }
        chances
    }

    #[test]
    fn chances_are_the_weights() {
        let many: Vec<f64> = (0..1000).map(|i| f64::from(i * i % 97)).collect();
        for weights in [vec![1.0], vec![1.0, 3.0], vec![0.0, 5.0, 0.0, 1e-9, 2.0], many] {
            let rows = table(&weights).unwrap();
            let sum: f64 = weights.iter().sum();
            for (chance, weight) in chances(&rows).iter().zip(&weights) {
                assert!((chance - weight / sum).abs() < 1e-9, "{chance} {weight}");
                assert!(*weight > 0.0 || *chance == 0.0);
            }
        }
    }

    #[test]
    fn nothing_to_choose_from() {
        assert_eq!(table(&[]), None);
        assert_eq!(table(&[0.0, 0.0]), None);
        assert_eq!(table(&[f64::INFINITY]), None);
    }
}
