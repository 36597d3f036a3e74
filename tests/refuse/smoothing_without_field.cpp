// expect: smoothing needs `field(t, x, s, p)`, written with the true magnitude
// SPDX-License-Identifier: BSD-3-Clause
#include <filippov/models/dieci_lopez.hpp>
#include <filippov/system/smoothing.hpp>

int main() {
    // its sides have poles beyond their surface
    const auto smooth = filippov::smoothed(filippov::models::DieciLopez{});
    return static_cast<int>(smooth.how.band);
}
