// SPDX-License-Identifier: BSD-3-Clause
#include "systems.hpp"

#include <filippov/models/dieci_lopez.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/models/relay.hpp>

using namespace filippov;

std::shared_ptr<const AnySystem> oscillator_system(const Precision& precision) {
    return any_system(models::Oscillator{}, precision);
}
std::shared_ptr<const AnySystem> oscillator_system_5(const Precision& precision) {
    return any_system<DormandPrince5>(models::Oscillator{}, precision);
}
std::shared_ptr<const AnySystem> dieci_lopez_system(const Precision& precision) {
    return any_system(models::DieciLopez{}, precision);
}
std::shared_ptr<const AnySystem> relay_system(const Precision& precision) {
    return any_system(models::Relay{}, precision);
}
