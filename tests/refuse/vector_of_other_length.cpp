// expect: filippov: expected one value for each of the system's `params`
#include <filippov/engine/flow.hpp>

template <class S, int N> using Vec = filippov::Vec<S, N>;

struct VectorOfOtherLength {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 3> params{"a", "b", "c"};
    template <class S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 3>&) const {
        return {x[1], S(1)};
    }
    template <class S> Vec<S, 2> f2(const S&, const Vec<S, 2>& x, const Vec<S, 3>&) const {
        return {x[1], S(-1)};
    }
    template <class S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 3>&) const { return x[1]; }
};

int main() {
    filippov::EventLog<double, 2, 1> log;
    const filippov::Settings<double, 2> settings;
    filippov::flow(VectorOfOtherLength{}, Vec<double, 2>(1, 2), Vec<double, 2>(0, 0), 0, 1,
                   settings, log);
}
