// expect: filippov: a system needs `template <class S> S h(
#include <filippov/engine/flow.hpp>

template <class S, int N> using Vec = filippov::Vec<S, N>;

struct WrongParameters {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 3> params{"a", "b", "c"};
    template <class S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(1)};
    }
    template <class S> Vec<S, 2> f2(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(-1)};
    }
    template <class S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return x[1]; }
};

int main() {
    filippov::EventLog<double, 2, 1> log;
    return static_cast<int>(filippov::flow(WrongParameters{}, Vec<double, 3>(1, 2, 3),
                                           Vec<double, 2>(0, 0), 0, 1,
                                           filippov::Settings<double, 2>{}, log)
                                .status);
}
