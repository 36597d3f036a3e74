// SPDX-License-Identifier: BSD-3-Clause
// The scalar engine of a system whose type is forgotten: what lanes hand members over to, and may
// be compiled apart from.
#pragma once

#include <filippov/ensemble/population.hpp>

#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace filippov {

/// What the runs of an ensemble are told: see Settings.
struct EnsembleSettings {
    double rtol = 1e-8;
    std::vector<double> atol{1e-10}; ///< shape (dim,), or one for all
    double max_step = std::numeric_limits<double>::infinity();
    double first_step = 0;
    long long max_steps = 100'000'000, max_events = 10'000'000; ///< of a member
    NonUnique on_nonunique = NonUnique::stop;
    bool eighth_order = true; ///< Dormand-Prince 8(5,3), else 5(4)
};

/// Stretches of a system whose type is forgotten, with EnsembleSettings.
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
    virtual std::shared_ptr<const void> engine(const EnsembleSettings& settings) const = 0;
};

namespace detail {

/// @param n  components that there are
template <int N> Settings<double, N> sized_settings(const EnsembleSettings& s, int n) {
    if (s.atol.size() != 1 && s.atol.size() != std::size_t(n))
        refuse("atol.size()", double(s.atol.size()), "expected one entry, or dim");
    Settings<double, N> own;
    own.rtol = s.rtol;
    own.atol = padded<N>(s.atol, int(s.atol.size()), s.atol[0]);
    own.max_step = s.max_step;
    own.first_step = s.first_step;
    own.max_steps = s.max_steps;
    own.max_events = s.max_events;
    own.on_nonunique = s.on_nonunique;
    return own;
}

template <class Sys> class ErasedScalar final : public AnyScalar {
    static constexpr int N = dim_v<Sys>, P = params_v<Sys>;

public:
    explicit ErasedScalar(Sys sys) : sys_(std::move(sys)) {}

    int dim() const override { return N; }
    int params() const override { return P; }
    std::shared_ptr<const void> engine(const EnsembleSettings& settings) const override {
        const auto own = sized_settings<N>(settings, component_count(sys_));
        if (settings.eighth_order)
            return erased(std::make_shared<FlowEngine<Sys, DormandPrince8>>(sys_, own));
        return erased(std::make_shared<FlowEngine<Sys, DormandPrince5>>(sys_, own));
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
