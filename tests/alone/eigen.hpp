// SPDX-License-Identifier: BSD-3-Clause
// What most headers have in common, read once when each is compiled alone: Eigen, with the solvers
// that dominate its time. (Which header includes which solver is a matter of check_floors.py.)
#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

#include <functional>
#include <string>
#include <vector>

// Where a compiler keeps what templates became, it keeps these.
inline void solve_by_all(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, Eigen::VectorXd& x) {
    x = Eigen::EigenSolver<Eigen::MatrixXd>(A).eigenvalues().real() + A.eigenvalues().real();
    x += Eigen::FullPivLU<Eigen::MatrixXd>(A).solve(b) + A.partialPivLu().solve(b);
    x *= A.partialPivLu().determinant();
    x += A.completeOrthogonalDecomposition().solve(b);
    x += Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(A.transpose()).solve(b);
    const Eigen::MatrixXd Q = Eigen::HouseholderQR<Eigen::MatrixXd>(A.transpose()).householderQ();
    x += Q * b + Eigen::HouseholderQR<Eigen::MatrixXd>(A).solve(b);
    x += Eigen::JacobiSVD<Eigen::MatrixXd>(A, Eigen::ComputeFullV).matrixV().col(0);
}
