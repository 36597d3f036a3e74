// expect: filippov: `equivalent_control` is there and cannot be used: expected
#include <filippov/system/system.hpp>

template <class S, int N> using Vec = filippov::Vec<S, N>;

struct EquivalentControlForDoubleOnly {
    static constexpr int dim = 2;
    template <class S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(1)};
    }
    template <class S> Vec<S, 2> f2(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(-1)};
    }
    template <class S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return x[1]; }
    double equivalent_control(const double&, const Vec<double, 2>&, const Vec<double, 0>&) const {
        return 0;
    }
};

int main() { filippov::require_system<EquivalentControlForDoubleOnly>(); }
