//! Sums of non-negative numbers that do not depend on the order of the additions, to the last bit.
//!
//! Floating-point addition is not associative: two machines that share the iterations of a render would get
//! other bits than one. Here the line of binary digits is cut into bins of 36 bits at fixed places. A number
//! is cut with it, and what falls into a bin is added to an integer; nothing is ever carried from bin to bin.
//! Two bins are kept: that of the first digit of the largest number so far, and the one below. When a larger
//! number moves them up, what was below is dropped as a whole, and it is the same whether it was dropped
//! before it was added or after. So the state is a function of the numbers as a set.
//!
//! The price: of every number the digits below 2⁻³⁶ of the largest are lost, hence a mean is too small by
//! less than 2⁻³⁶ of the largest number. Without a spread of more than 2¹² among single-precision numbers
//! nothing is lost at all.
//!
//! Source: the bins of J. Demmel and H. D. Nguyen, "Fast Reproducible Floating-Point Summation", ARITH 2013,
//! with integers. Oracle: `tests::is_the_exact_sum_of_the_digits_kept`.

/// Binary digits per bin.
const DIGITS: i32 = 36;

/// Numbers that a sum may have: beyond, a bin could overflow.
pub(crate) const MAX_COUNT: u64 = 1 << (64 - DIGITS);

/// Places of the first digits of the least and of the greatest number in double precision.
const PLACES: std::ops::RangeInclusive<i8> = -30..=28;

/// A sum per channel: the upper and the lower bin of each, in units of their last digits, then [a
/// byte](place) for each that says where these are.
///
/// Plain words, of which zeros are sums of nothing: so that memory for a large film is there at once, and is
/// taken as it is used.
pub(crate) type Sum3 = [u64; 7];

/// Sums of nothing.
pub(crate) const ZERO: Sum3 = [0; 7];

/// The place of a sum of nothing.
const NOWHERE: i8 = i8::MIN;

/// The bytes of a sum in a file, at most.
pub(crate) const MAX_ENCODED: usize = 3 * 17;

/// Place of the upper bin of a channel, which counts multiples of `2^(36 place)`. `NOWHERE` while the sum is
/// zero.
fn place(sum: &Sum3, c: usize) -> i8 {
    ((sum[6] >> (8 * c)) as u8 ^ 0x80).cast_signed()
}

fn set_place(sum: &mut Sum3, c: usize, place: i8) {
    let byte = u64::from(place.cast_unsigned() ^ 0x80);
    sum[6] = sum[6] & !(0xff << (8 * c)) | byte << (8 * c);
}

fn bins(sum: &Sum3, c: usize) -> [u64; 2] {
    [sum[2 * c], sum[2 * c + 1]]
}

fn set_bins(sum: &mut Sum3, c: usize, bins: [u64; 2]) {
    sum[2 * c..2 * c + 2].copy_from_slice(&bins);
}

/// Adds a number per channel: zero, or positive and finite.
#[inline]
pub(crate) fn add(sum: &mut Sum3, values: [f64; 3]) {
    for (c, value) in values.into_iter().enumerate() {
        debug_assert!(value >= 0.0 && value.is_finite(), "{value}");
        if value > 0.0 {
            add_to(sum, c, value);
        }
    }
}

#[inline]
fn add_to(sum: &mut Sum3, c: usize, value: f64) {
    // Nearly always the place stays, and so do its powers of two normal numbers: then floating-point numbers
    // cut the value, without rounding.
    let place_before = place(sum, c);
    if (-27..=27).contains(&place_before) {
        let in_upper = value * power_of_two(-DIGITS * i32::from(place_before));
        if in_upper < power_of_two(DIGITS) {
            let upper = in_upper as u64;
            sum[2 * c] += upper;
            sum[2 * c + 1] += ((in_upper - upper as f64) * power_of_two(DIGITS)) as u64;
            return;
        }
    }
    add_anywhere(sum, c, value);
}

/// Adds a positive number, whatever its place.
#[cold]
fn add_anywhere(sum: &mut Sum3, c: usize, value: f64) {
    let (digits, exponent) = decompose(value);
    let first = exponent + digits.ilog2().cast_signed();
    let upper = first.div_euclid(DIGITS) as i8;
    if upper > place(sum, c) {
        set_bins(sum, c, seen_from(sum, c, upper));
        set_place(sum, c, upper);
    }
    // Units of the lower bin: at most 72 digits, since the first one is in the upper bin or below.
    let shift = exponent - DIGITS * (i32::from(place(sum, c)) - 1);
    let units = match shift {
        0.. => u128::from(digits) << shift,
        -63..0 => u128::from(digits >> -shift),
        _ => 0,
    };
    sum[2 * c] += (units >> DIGITS) as u64;
    sum[2 * c + 1] += units as u64 & ((1 << DIGITS) - 1);
}

/// Adds other sums. The two together must be of no more than [`MAX_COUNT`] numbers.
pub(crate) fn merge(sum: &mut Sum3, other: &Sum3) {
    for c in 0..3 {
        let upper = place(sum, c).max(place(other, c));
        let (own, others) = (seen_from(sum, c, upper), seen_from(other, c, upper));
        set_bins(sum, c, [own[0] + others[0], own[1] + others[1]]);
        set_place(sum, c, upper);
    }
}

/// The bins of a channel at another place, not below the present one.
fn seen_from(sum: &Sum3, c: usize, upper: i8) -> [u64; 2] {
    let [high, low] = bins(sum, c);
    match i16::from(upper) - i16::from(place(sum, c)) {
        0 => [high, low],
        1 => [0, high],
        _ => [0, 0],
    }
}

/// The sums, rounded to double precision; what is below 2⁻¹⁰²² becomes zero.
#[inline]
pub(crate) fn values(sum: &Sum3) -> [f64; 3] {
    std::array::from_fn(|c| {
        if place(sum, c) == NOWHERE {
            return 0.0;
        }
        let [upper, lower] = bins(sum, c).map(|units| units as f64);
        (upper + lower * power_of_two(-DIGITS)) * power_of_two(DIGITS * i32::from(place(sum, c)))
    })
}

/// Appends the sums in the least space: a place, then two bins unless the sum is zero.
pub(crate) fn encode(sum: &Sum3, out: &mut Vec<u8>) {
    for c in 0..3 {
        out.extend(place(sum, c).to_le_bytes());
        if place(sum, c) != NOWHERE {
            out.extend(bins(sum, c).into_iter().flat_map(u64::to_le_bytes));
        }
    }
}

/// Takes from the front of `bytes` what [`encode`] wrote. `None` if it is no sum of `count` numbers.
pub(crate) fn decode(bytes: &mut &[u8], count: u64) -> Option<Sum3> {
    let mut sum = ZERO;
    for c in 0..3 {
        let place = i8::from_le_bytes(*take(bytes)?);
        if place == NOWHERE {
            continue;
        }
        let bins = [u64::from_le_bytes(*take(bytes)?), u64::from_le_bytes(*take(bytes)?)];
        let most = count.min(MAX_COUNT) * ((1 << DIGITS) - 1);
        // The largest number has its first digit in the upper bin.
        if !PLACES.contains(&place) || bins[0] == 0 || bins.iter().any(|bin| *bin > most) {
            return None;
        }
        set_place(&mut sum, c, place);
        set_bins(&mut sum, c, bins);
    }
    Some(sum)
}

fn take<'a, const N: usize>(bytes: &mut &'a [u8]) -> Option<&'a [u8; N]> {
    let (first, rest) = bytes.split_first_chunk()?;
    *bytes = rest;
    Some(first)
}

/// A positive finite number as `digits · 2^exponent`.
fn decompose(value: f64) -> (u64, i32) {
    let bits = value.to_bits();
    let (biased, fraction) = ((bits >> 52) as i32, bits & ((1 << 52) - 1));
    if biased == 0 { (fraction, -1074) } else { (fraction | 1 << 52, biased - 1075) }
}

/// `2^exponent` for an exponent below 1024; zero where that is not a normal number.
fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((exponent + 1023).max(0) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Positive numbers over the whole range, zero, and runs of similar ones.
    fn numbers() -> impl Strategy<Value = Vec<f64>> {
        let number = prop_oneof![
            4 => (1.0..2.0_f64, -66..67_i32).prop_map(|(m, e)| m * 2_f64.powi(e)),
            4 => (1.0..2.0_f32, -4..4_i32).prop_map(|(m, e)| f64::from(m) * 2_f64.powi(e)),
            1 => Just(0.0),
            1 => (1..u64::MAX >> 12).prop_map(f64::from_bits),
            1 => (1.0..2.0_f64).prop_map(|m| m * 2_f64.powi(1023)),
        ];
        proptest::collection::vec(number, 0..60)
    }

    fn sum(numbers: &[f64]) -> Sum3 {
        let mut sum = ZERO;
        for number in numbers {
            add(&mut sum, [*number, 0.0, 0.5 * number]);
        }
        sum
    }

    /// The bins by definition: with all numbers known, cut each at the two places, one digit after the other.
    fn by_definition(numbers: &[f64]) -> Option<(i8, [u64; 2])> {
        let digits_of = |number: f64| {
            let (digits, exponent) = decompose(number);
            (0..53).filter(move |bit| digits >> bit & 1 == 1).map(move |bit| exponent + bit)
        };
        let first = numbers.iter().filter_map(|number| digits_of(*number).max()).max()?;
        let place = (f64::from(first) / 36.0).floor() as i32;
        let mut bins = [0; 2];
        for digit in numbers.iter().flat_map(|number| digits_of(*number)) {
            match digit - 36 * place {
                above @ 0.. => bins[0] += 1 << above,
                below @ -36..0 => bins[1] += 1 << (below + 36),
                _ => {}
            }
        }
        Some((place as i8, bins))
    }

    proptest! {
        #[test]
        fn is_the_exact_sum_of_the_digits_kept(numbers in numbers()) {
            let sum = sum(&numbers);
            let expected = by_definition(&numbers).unwrap_or((NOWHERE, [0; 2]));
            prop_assert_eq!((place(&sum, 0), bins(&sum, 0)), expected);
        }

        #[test]
        fn order_and_split_make_no_difference(
            (numbers, shuffled) in numbers().prop_flat_map(|n| (Just(n.clone()), Just(n).prop_shuffle())),
            split in 0..60_usize,
            flip in any::<bool>(),
        ) {
            let whole = sum(&numbers);
            let (a, b) = shuffled.split_at(split.min(shuffled.len()));
            let (mut first, second) = if flip { (sum(a), sum(b)) } else { (sum(b), sum(a)) };
            merge(&mut first, &second);
            prop_assert_eq!(first, whole);
        }

        #[test]
        fn little_is_lost(numbers in numbers()) {
            let numbers: Vec<f64> = numbers.into_iter().filter(|x| *x == 0.0 || (1e-30..1e30).contains(x)).collect();
            let found = values(&sum(&numbers))[0];
            let exact: f64 = numbers.iter().sum();
            let largest = numbers.iter().copied().fold(0.0, f64::max);
            let lost = largest * numbers.len() as f64 * (-36_f64).exp2();
            let rounding = 1e-14 * exact;
            prop_assert!(found <= exact + rounding && found >= exact - lost - rounding, "{found} {exact}");
        }

        #[test]
        fn survives_a_file(numbers in numbers()) {
            let sum = sum(&numbers);
            let mut bytes = Vec::new();
            encode(&sum, &mut bytes);
            prop_assert!(bytes.len() <= MAX_ENCODED);
            let mut rest = bytes.as_slice();
            prop_assert_eq!(decode(&mut rest, numbers.len() as u64), Some(sum));
            prop_assert!(rest.is_empty());
            for end in 0..bytes.len() {
                prop_assert_eq!(decode(&mut &bytes[..end], numbers.len() as u64), None);
            }
        }

        #[test]
        fn any_bytes_decode_to_something_that_can_be_merged(bytes in proptest::collection::vec(any::<u8>(), 0..60)) {
            let half = MAX_COUNT / 2;
            if let Some(sum) = decode(&mut bytes.as_slice(), half) {
                let mut twice = sum;
                merge(&mut twice, &sum);
                prop_assert!(values(&twice).iter().all(|v| *v >= 0.0));
            }
        }
    }

    #[test]
    fn single_precision_within_a_factor_of_4096_is_exact() {
        let mut sum = ZERO;
        let (large, small) = (f32::from_bits(0x3fff_ffff), f32::from_bits(0x3a00_0001));
        let mut units = 0_u128;
        for _ in 0..100_000 {
            add(&mut sum, [f64::from(large), f64::from(small), f64::from(large) + f64::from(small)]);
            units += [large, small].map(|x| (f64::from(x) * 2_f64.powi(36)) as u128).iter().sum::<u128>();
        }
        let total = bins(&sum, 2);
        assert_eq!(place(&sum, 2), 0);
        assert_eq!((u128::from(total[0]) << 36) + u128::from(total[1]), units);
    }

    #[test]
    fn as_many_numbers_as_allowed_fit() {
        let most = [[(MAX_COUNT - 1) * ((1 << DIGITS) - 1); 6].as_slice(), &[0x80_8080]].concat();
        let mut sum: Sum3 = most.try_into().unwrap();
        let before = bins(&sum, 0);
        assert_eq!(place(&sum, 2), 0);
        add(&mut sum, [2_f64.powi(DIGITS) - 1.0; 3]);
        assert!(bins(&sum, 0)[0] > before[0]);
        assert_eq!(bins(&sum, 0)[0], MAX_COUNT * ((1 << DIGITS) - 1));
    }
}
