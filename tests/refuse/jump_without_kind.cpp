// expect: filippov: `jump` is there and no surface is of kind `jump`
#include <filippov/system/system.hpp>

template <class S, int N> using Vec = filippov::Vec<S, N>;

struct JumpWithoutKind {
    static constexpr int dim = 2;
    template <class S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(1)};
    }
    template <class S> Vec<S, 2> f2(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(-1)};
    }
    template <class S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return x[1]; }
    template <class S> Vec<S, 2> jump(int, const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[0], -x[1]};
    }
};

int main() { filippov::require_system<JumpWithoutKind>(); }
