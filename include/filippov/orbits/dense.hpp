// SPDX-License-Identifier: BSD-3-Clause
// Solvers of dense matrices of any size. They take longer to compile than what asks them: they are
// inline, or, where FILIPPOV_COMPILED is defined, in the library filippov::compiled.
#pragma once

#include <filippov/orbits/system_interface.hpp>

#if !defined(FILIPPOV_COMPILED) || defined(FILIPPOV_COMPILING)
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#endif

namespace filippov::dense {

/// x of A x = b, A square and regular.
FILIPPOV_IN_LIBRARY Vector solve(const Matrix& A, const Vector& b);
/// The same, and whether A is regular, to rounding.
struct Solved {
    Vector x;
    bool regular;
};
FILIPPOV_IN_LIBRARY Solved solve_and_judge(const Matrix& A, const Vector& b);
/// The shortest x with the least |A x - b|. Pivots below `threshold` of the largest count as zero;
/// 0: those that are rounding.
FILIPPOV_IN_LIBRARY Vector shortest(const Matrix& A, const Vector& b, double threshold = 0);
/// x with the least |A x - b|, the columns of A independent.
FILIPPOV_IN_LIBRARY Vector least_squares(const Matrix& A, const Vector& b);
FILIPPOV_IN_LIBRARY double determinant(const Matrix& A);

/// An orthogonal matrix whose first columns span those of A, one after the other.
FILIPPOV_IN_LIBRARY Matrix orthogonal(const Matrix& A);
/// A = Q R: the columns of Q that A has, and the magnitudes of R's diagonal.
struct Frame {
    Matrix Q;
    Vector r;
};
FILIPPOV_IN_LIBRARY Frame frame(const Matrix& A);
/// The same with columns taken by their size: magnitudes on the diagonal of R, and all of Q.
FILIPPOV_IN_LIBRARY Vector pivots(const Matrix& A);
FILIPPOV_IN_LIBRARY Matrix orthogonal_by_size(const Matrix& A);

FILIPPOV_IN_LIBRARY Eigen::VectorXcd eigenvalues(const Matrix& A);
struct EigenPairs {
    Eigen::VectorXcd values;
    Eigen::MatrixXcd vectors; ///< in columns
};
FILIPPOV_IN_LIBRARY EigenPairs eigen_pairs(const Matrix& A);
/// The unit vector v with the least |A v|.
FILIPPOV_IN_LIBRARY Vector least_stretched(const Matrix& A);

} // namespace filippov::dense

#if !defined(FILIPPOV_COMPILED) || defined(FILIPPOV_COMPILING)

namespace filippov::dense {

FILIPPOV_IN_LIBRARY Vector solve(const Matrix& A, const Vector& b) {
    return A.partialPivLu().solve(b);
}
FILIPPOV_IN_LIBRARY Solved solve_and_judge(const Matrix& A, const Vector& b) {
    const Eigen::FullPivLU<Matrix> lu(A);
    return {lu.solve(b), lu.isInvertible()};
}
FILIPPOV_IN_LIBRARY Vector shortest(const Matrix& A, const Vector& b, double threshold) {
    Eigen::CompleteOrthogonalDecomposition<Matrix> solver;
    if (threshold > 0)
        solver.setThreshold(threshold);
    solver.compute(A);
    return solver.solve(b);
}
FILIPPOV_IN_LIBRARY Vector least_squares(const Matrix& A, const Vector& b) {
    return A.householderQr().solve(b);
}
FILIPPOV_IN_LIBRARY double determinant(const Matrix& A) { return A.partialPivLu().determinant(); }

FILIPPOV_IN_LIBRARY Matrix orthogonal(const Matrix& A) {
    return Eigen::HouseholderQR<Matrix>(A).householderQ();
}
FILIPPOV_IN_LIBRARY Frame frame(const Matrix& A) {
    const Eigen::HouseholderQR<Matrix> qr(A);
    return {qr.householderQ() * Matrix::Identity(A.rows(), A.cols()),
            qr.matrixQR().diagonal().head(A.cols()).cwiseAbs()};
}
FILIPPOV_IN_LIBRARY Vector pivots(const Matrix& A) {
    return Eigen::ColPivHouseholderQR<Matrix>(A).matrixQR().diagonal().cwiseAbs();
}
FILIPPOV_IN_LIBRARY Matrix orthogonal_by_size(const Matrix& A) {
    return Eigen::ColPivHouseholderQR<Matrix>(A).householderQ();
}

FILIPPOV_IN_LIBRARY Eigen::VectorXcd eigenvalues(const Matrix& A) { return A.eigenvalues(); }
FILIPPOV_IN_LIBRARY EigenPairs eigen_pairs(const Matrix& A) {
    const Eigen::EigenSolver<Matrix> solver(A);
    return {solver.eigenvalues(), solver.eigenvectors()};
}
FILIPPOV_IN_LIBRARY Vector least_stretched(const Matrix& A) {
    return Eigen::JacobiSVD<Matrix>(A, Eigen::ComputeFullV).matrixV().col(A.cols() - 1);
}

} // namespace filippov::dense

#endif
