// SPDX-License-Identifier: BSD-3-Clause
#include "lines.hpp"

#include "ask.hpp"

namespace filippov::strangers {

namespace {

/// Three lines in disguise: what the engine sees.
class Disguised {
public:
    static constexpr int dim = 3, surfaces = 3;
    template <class S> using X = Vec<S, 3>;
    template <class S> using None = Vec<S, 0>;

    Disguised(const ThreeLines& law, const Disguise& disguise) : law_(&law), disguise_(&disguise) {}

    const Disguise& disguise() const { return *disguise_; }
    bool is_forced() const { return disguise_->period > 0; }
    template <class S> S period(const None<S>&) const { return S(disguise_->period); }
    template <Scalar S>
    X<S> field(const S&, const X<S>& x, const Vec<S, 3>& s, const None<S>&) const {
        const X<S> z = disguise_->natural<S>(x);
        X<S> rate;
        law_->field(s.data(), rate.data());
        return disguise_->rates<S>(z, rate);
    }
    template <Scalar S> Vec<S, 3> h(const S&, const X<S>& x, const None<S>&) const {
        const X<S> z = disguise_->natural<S>(x);
        Vec<S, 3> value;
        for (int j = 0; j < 3; ++j)
            value[j] = S(disguise_->height[std::size_t(j)]) * law_->h(std::size_t(j), z.data());
        return value;
    }
    bool has_section() const { return false; }
    template <class S> S section(const S&, const X<S>&) const { return S(1); }

private:
    const ThreeLines* law_;
    const Disguise* disguise_;
};

} // namespace

Told ask_lines(const ThreeLines& law, const Disguise& disguise, const Ask& ask) {
    return ask_engine(Disguised(law, disguise), ask);
}

} // namespace filippov::strangers
