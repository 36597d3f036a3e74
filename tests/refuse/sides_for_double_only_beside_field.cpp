// expect: filippov: `f1` and `f2`, `region` or `f` must be templates over the scalar S
#include <filippov/system/system.hpp>

template <class S, int N> using Vec = filippov::Vec<S, N>;

struct SidesForDoubleOnlyBesideField {
    static constexpr int dim = 2;
    Vec<double, 2> f1(const double&, const Vec<double, 2>& x, const Vec<double, 0>&) const {
        return {x[1], 1};
    }
    Vec<double, 2> f2(const double&, const Vec<double, 2>& x, const Vec<double, 0>&) const {
        return {x[1], -1};
    }
    template <class S>
    Vec<S, 2> field(const S&, const Vec<S, 2>& x, const S& s, const Vec<S, 0>&) const {
        return {x[1], -s};
    }
    template <class S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return x[1]; }
};

int main() { filippov::require_system<SidesForDoubleOnlyBesideField>(); }
