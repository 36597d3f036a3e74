// SPDX-License-Identifier: BSD-3-Clause
// The scalar engine of a system whose type is forgotten: what lanes hand members over to, and may
// be compiled apart from.
#pragma once

#include <filippov/ensemble/population.hpp>
#include <filippov/run/run_settings.hpp>

#include <memory>
#include <utility>
#include <vector>

namespace filippov {

/// Stretches of a system whose type is forgotten.
class AnyScalar {
public:
    virtual ~AnyScalar() = default;
    AnyScalar() = default;
    AnyScalar(const AnyScalar&) = delete;
    AnyScalar& operator=(const AnyScalar&) = delete;

    /// The sizes that it is compiled for.
    virtual int dim() const = 0;
    virtual int params() const = 0;
    /// The engine for these settings: a ScalarEngine<dim, params>, which the caller knows to cast.
    /// @error std::invalid_argument for a method that lanes do not have
    virtual std::shared_ptr<const void> engine(const RunSettings& settings) const = 0;
};

namespace detail {

template <class Sys> class ErasedScalar final : public AnyScalar {
    static constexpr int N = dim_v<Sys>, P = params_v<Sys>;

public:
    explicit ErasedScalar(Sys sys) : sys_(std::move(sys)) {}

    int dim() const override { return N; }
    int params() const override { return P; }
    std::shared_ptr<const void> engine(const RunSettings& settings) const override {
        const auto own = sized_settings<N>(settings, component_count(sys_));
        if (settings.method == Method::dop853)
            return erased(std::make_shared<FlowEngine<Sys, DormandPrince8>>(sys_, own));
        if (settings.method == Method::dopri5)
            return erased(std::make_shared<FlowEngine<Sys, DormandPrince5>>(sys_, own));
        refuse("method", int(settings.method), "expected Method::dopri5 or Method::dop853");
    }

private:
    static std::shared_ptr<const void> erased(std::shared_ptr<const ScalarEngine<N, P>> engine) {
        return engine;
    }
    const Sys sys_;
};

} // namespace detail

/// The scalar engine of a system, its type forgotten.
template <class Sys> std::shared_ptr<const AnyScalar> any_scalar(const Sys& sys) {
    require_system<Sys>();
    return std::make_shared<detail::ErasedScalar<Sys>>(sys);
}

} // namespace filippov
