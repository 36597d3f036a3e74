// expect: `defaults` needs one value for each of `params`
#include <filippov/system/system.hpp>

#include <array>
#include <string_view>

template <class S, int N> using Vec = filippov::Vec<S, N>;

struct DefaultsTooFew {
    static constexpr int dim = 1;
    static constexpr std::array<std::string_view, 2> params{"a", "b"};
    static constexpr std::array<double, 1> defaults{1};
    template <class S> Vec<S, 1> f1(const S&, const Vec<S, 1>&, const Vec<S, 2>& p) const {
        return Vec<S, 1>(p[0]);
    }
    template <class S> Vec<S, 1> f2(const S&, const Vec<S, 1>&, const Vec<S, 2>& p) const {
        return Vec<S, 1>(p[1]);
    }
    template <class S> S h(const S&, const Vec<S, 1>& x, const Vec<S, 2>&) const { return x[0]; }
};

int main() { return int(filippov::default_params<DefaultsTooFew>()[1]); }
