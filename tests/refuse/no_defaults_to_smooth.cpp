// expect: filippov: `{}` for the parameters of a system that has parameters and no `defaults`
#include <filippov/engine/flow.hpp>
#include <filippov/system/smoothing.hpp>

template <class S, int N> using Vec = filippov::Vec<S, N>;

struct NoDefaultsToSmooth {
    static constexpr int dim = 1;
    static constexpr std::array<std::string_view, 2> params{"a", "b"};
    template <class S>
    Vec<S, 1> field(const S&, const Vec<S, 1>&, const S& s, const Vec<S, 2>& p) const {
        return Vec<S, 1>(p[0] - p[1] * s);
    }
    template <class S> S h(const S&, const Vec<S, 1>& x, const Vec<S, 2>&) const { return x[0]; }
};

int main() {
    filippov::EventLog<double, 1, 2> log;
    const filippov::Settings<double, 1> settings;
    filippov::flow(filippov::smoothed(NoDefaultsToSmooth{}), {}, Vec<double, 1>(0), 0, 1, settings,
                   log);
}
