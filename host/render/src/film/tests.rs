use super::*;
use glam::Vec3;

/// Returns the block of all of a film's rows, and these samples.
fn part(film: &Film, samples: Range<u32>) -> SampleBlock {
    SampleBlock { rows: 0..film.height, samples }
}

/// Adds a chunk of `samples` samples after those that the film holds.
fn merge(film: &mut Film, chunk: &[PixelSums], samples: u32) {
    let next = film.coverage.samples(0).last().map_or(0, |range| range.end);
    film.merge(&part(film, next..next + samples), chunk).unwrap();
}

fn sums(value: f32, samples: u32) -> PixelSums {
    PixelSums {
        radiance: Vec3::splat(value),
        samples,
        squares: Vec3::splat(value * value),
        segments: 2 * samples,
    }
}

#[test]
fn chunks_add_up_and_rejections_are_counted() {
    let mut film = Film::new(1, 1);
    merge(&mut film, &[sums(2.0, 4)], 4);
    merge(&mut film, &[sums(4.0, 3)], 4);
    assert_eq!(film.pixels.exact()[0].radiance.map(ExactSum::value), [6.0; 3]);
    assert_eq!(film.counts(), FilmCounts { samples: 7, rejected: 1, segments: 14, unwritten: 0 });
}

#[test]
fn an_unwritten_pixel_shows() {
    let mut film = Film::new(2, 1);
    assert!(film.image().pixels[0][0].is_nan());
    merge(&mut film, &[sums(1.0, 1), PixelSums::UNWRITTEN], 1);
    let image = film.image();
    assert!(image.pixels[0] == [1.0; 3] && image.pixels[1][0].is_nan());
    assert_eq!(film.counts().unwritten, 1);
    // A later chunk does not hide it, and a lost chunk spoils an earlier one.
    merge(&mut film, &[PixelSums::UNWRITTEN, sums(1.0, 1)], 1);
    assert!(film.image().pixels.iter().flatten().all(|value| value.is_nan()));
    assert_eq!(film.counts().unwritten, 2);
}

/// Torture tests 21 and 22: a constant does not stagnate, and a large term does not swallow its
/// neighbours for good. The error that remains is that of 0.1 as an f32 and of one rounding a
/// chunk, 2^-25 each.
#[test]
fn totals_neither_stagnate_nor_drift() {
    let mut film = Film::new(1, 1);
    let (mut chunk, mut carry) = (PixelSums::ZERO, Compensation::ZERO);
    for _ in 0..256 {
        chunk.add(Vec3::splat(0.1), &mut carry, 0);
    }
    chunk.compensate(carry);
    for _ in 0..1 << 17 {
        merge(&mut film, &[chunk], 256);
    }
    let mean = film.pixels.exact()[0].mean()[0];
    assert!((mean / 0.1 - 1.0).abs() < 1e-7, "{mean}");
    let in_f32 = (0..1 << 25).fold(0.0f32, |sum, _| sum + 0.1) / (1 << 25) as f32;
    assert!((in_f32 / 0.1 - 1.0).abs() > 0.1, "the negative control, one f32 sum, must fail: {in_f32}");

    let mut film = Film::new(1, 1);
    for value in [16_777_216.0, 1.0, -16_777_216.0] {
        merge(&mut film, &[sums(value, 1)], 1);
    }
    assert_eq!(film.image().pixels[0][0], 1.0 / 3.0);
}

#[test]
fn variance_of_the_mean() {
    let mut film = Film::new(1, 1);
    for value in [1.0, 3.0] {
        merge(&mut film, &[sums(value, 1)], 1);
    }
    // Mean 2, sample variance 2, over n = 2.
    assert_eq!((film.pixels.exact()[0].mean()[0], film.pixels.exact()[0].variance_of_mean()[0]), (2.0, 1.0));
}

/// Returns chunks of a film of 3 rows, of which no two sums have the same bits.
fn chunks(film: &Film, count: u32) -> Vec<(SampleBlock, Vec<PixelSums>)> {
    let chunk = |c: u32| {
        let value = |i: u32| ((c * 131 + i * 17) % 1009) as f32 * 0.001 * 10f32.powi((c * i % 11) as i32 - 5);
        let pixels = (0..film.pixels.len() as u32).map(|i| sums(value(i), 256)).collect();
        (part(film, c * 256..(c + 1) * 256), pixels)
    };
    (0..count).map(chunk).collect()
}

#[test]
fn films_add_up_in_any_order_and_grouping() {
    let chunks = chunks(&Film::new(5, 3), 12);
    let of = |chunks: &mut dyn Iterator<Item = &(SampleBlock, Vec<PixelSums>)>| {
        let mut film = Film::new(5, 3);
        chunks.for_each(|(part, sums)| film.merge(part, sums).unwrap());
        film
    };
    let want = of(&mut chunks.iter());
    assert_eq!(of(&mut chunks.iter().rev()), want);
    for cut in 1..12 {
        let mut film = of(&mut chunks[cut..].iter());
        film.add(&of(&mut chunks[..cut].iter())).unwrap();
        assert_eq!(film, want, "{cut}");
    }
    // By rows: a pixel that one film did not write is taken from the other.
    let mut film = Film::new(5, 3);
    for row in [2, 0, 1] {
        let mut part_film = Film::new(5, 3);
        for (part, sums) in &chunks {
            let pixels = row as usize * 5..(row as usize + 1) * 5;
            part_film.merge(&SampleBlock { rows: row..row + 1, ..part.clone() }, &sums[pixels]).unwrap();
        }
        assert_eq!((part_film.counts().unwritten, part_film.counts_in(&(row..row + 1)).unwritten), (10, 0));
        film.add(&part_film).unwrap();
    }
    assert_eq!(film, want);
    // Negative control: a chunk is missing.
    assert_ne!(of(&mut chunks[1..].iter()), want, "the comparison detects nothing");
}

#[test]
fn what_does_not_fit_is_refused() {
    let mut film = Film::new(5, 3);
    let (part, chunk) = chunks(&film, 1).remove(0);
    let rows = |rows| SampleBlock { rows, ..part.clone() };
    film.merge(&rows(1..3), &chunk[5..]).unwrap();
    let before = film.clone();
    assert_eq!(film.merge(&part, &chunk), Err(FilmError::Overlap { row: 1, samples: 0..256 }));
    assert_eq!(film.add(&before), Err(FilmError::Overlap { row: 1, samples: 0..256 }));
    assert!(matches!(film.merge(&rows(0..1), &chunk[1..]), Err(FilmError::Chunk { pixels: 14, .. })));
    assert!(matches!(film.merge(&rows(2..4), &chunk[5..]), Err(FilmError::Chunk { .. })));
    assert_eq!(film.add(&Film::new(3, 5)), Err(FilmError::Size { film: (5, 3), other: (3, 5) }));
    assert_eq!(film.counts(), before.counts());
    film.merge(&rows(0..1), &chunk[..5]).unwrap();
    assert_eq!(film.counts().unwritten, 0);
}

#[test]
fn a_lost_chunk_spoils_the_sum_of_films() {
    let (mut a, mut b) = (Film::new(1, 1), Film::new(1, 1));
    a.merge(&part(&a, 0..256), &[sums(1.0, 256)]).unwrap();
    b.merge(&part(&b, 256..512), &[PixelSums::UNWRITTEN]).unwrap();
    let mut other = b.clone();
    other.add(&a).unwrap();
    a.add(&b).unwrap();
    for film in [a, other] {
        assert!(film.pixels.exact()[0].mean()[0].is_nan());
        assert_eq!((film.counts().unwritten, film.pixels.exact()[0].samples), (1, 256));
    }
}
