//! Velocities of rotations and poses in the body frame, and as derivatives of their matrices.

/// Rᵀx for the rotation in the first three columns of a matrix with rows of `n` numbers.
fn to_body(point: &[f64], n: usize, x: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|j| (0..3).map(|i| point[i * n + j] * x[i]).sum())
}

/// Rx
fn from_body(point: &[f64], n: usize, x: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| (0..3).map(|j| point[i * n + j] * x[j]).sum())
}

/// ω with R' = R Ω, from the skew part of RᵀR'.
pub fn angular(point: &[f64], tangent: &[f64], n: usize) -> [f64; 3] {
    let column = |j: usize| to_body(point, n, std::array::from_fn(|i| tangent[i * n + j]));
    let w = [column(0), column(1), column(2)];
    [(w[1][2] - w[2][1]) / 2.0, (w[2][0] - w[0][2]) / 2.0, (w[0][1] - w[1][0]) / 2.0]
}

/// The rows of R' = R Ω.
pub fn rotation_rate(point: &[f64], [x, y, z]: [f64; 3], n: usize) -> [[f64; 3]; 3] {
    let columns = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]].map(|column| from_body(point, n, column));
    std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i]))
}

/// `v = Rᵀx'` for the position x in the last column of a pose.
pub fn linear(point: &[f64], tangent: &[f64]) -> [f64; 3] {
    to_body(point, 4, std::array::from_fn(|i| tangent[4 * i + 3]))
}

/// The derivative of a homogeneous matrix with angular velocity ω and linear velocity v in the body frame.
pub fn pose_rate(point: &[f64], angular: [f64; 3], linear: [f64; 3]) -> [f64; 16] {
    let (rate, linear) = (rotation_rate(point, angular, 4), from_body(point, 4, linear));
    std::array::from_fn(|k| match (k / 4, k % 4) {
        (3, _) => 0.0,
        (i, 3) => linear[i],
        (i, j) => rate[i][j],
    })
}
