/* SUNDIALS with root finding on the same matrices: the peer of `signorini precision --peer sundials`.
 *
 * Reads a problem written by signorini (argument 1: little-endian doubles, see `read_problem`) and prints one JSON object a line: method, rtol,
 * wall_s (median of argument 2 repetitions), setup_s (the phases' matrices), nfev, u, v, switches.
 *
 * Integrators: CVODE (Adams, fixed-point iteration) and ARKODE's explicit Runge-Kutta methods of order 5 and 8. A right-hand side is one product with the
 * dense M_a^-1 K_a of the phase, kept for every active set; roots are those of the gaps of free nodes and the pressures of nodes in contact, with friction of what
 * is left of the limit of nodes that stick, and of slip velocities. */

#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>
#include <time.h>

#define MOST_PHASES 1024
#define MOST_SWITCHES 100000

enum { OPEN, CLOSED, STICK, PLUS, MINUS };

typedef struct {
  int n_o, n_c;
  double until;
  double *m, *k, *nc, *no, *gap, *f, *u0, *v0;
  char *active0;
  /* with friction: tangents, largest forces over pressures, velocities of the surface */
  int rubs;
  double *e, *limit, *surface;
} Problem;

/* u'' = force - stiffness u, monitors rows u + rates u' + offset (one a point, two with friction), which lead to the states `to` */
typedef struct {
  char *active, *to;
  double *stiffness, *force, *rows, *rates, *offset;
} Phase;

typedef struct {
  const Problem *p;
  Phase phases[MOST_PHASES];
  int count;
  const Phase *phase;
  double setup;
  long nfev;
} Body;

static void fail(const char *what) {
  fprintf(stderr, "%s\n", what);
  exit(1);
}

static void *room(size_t n, size_t size) {
  void *x = calloc(n ? n : 1, size);
  if (!x) fail("out of memory");
  return x;
}

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}

static double *numbers(FILE *file, size_t n) {
  double *x = room(n, sizeof(double));
  if (fread(x, sizeof(double), n, file) != n) fail("the problem is cut short");
  return x;
}

static Problem read_problem(const char *name) {
  FILE *file = fopen(name, "rb");
  if (!file) fail("the problem cannot be read");
  double *head = numbers(file, 3);
  Problem p = {.n_o = (int)head[0], .n_c = (int)head[1], .until = head[2]};
  size_t o = p.n_o, c = p.n_c, n = o + c;
  p.m = numbers(file, n * n);
  p.k = numbers(file, n * n);
  p.nc = numbers(file, c * c);
  p.no = numbers(file, c * o);
  p.gap = numbers(file, c);
  p.f = numbers(file, n);
  p.u0 = numbers(file, o);
  p.v0 = numbers(file, o);
  double *active = numbers(file, c);
  p.active0 = room(c, 1);
  for (size_t i = 0; i < c; i++) p.active0[i] = active[i] != 0.0;
  free(active);
  free(head);
  int next = fgetc(file);
  p.rubs = next != EOF;
  if (p.rubs) {
    ungetc(next, file);
    p.e = numbers(file, c * o);
    p.limit = numbers(file, c);
    p.surface = numbers(file, c);
  }
  fclose(file);
  return p;
}

static int monitors(const Problem *p) { return p->rubs ? 2 * p->n_c : p->n_c; }

static double sign(char state) { return state == PLUS ? 1.0 : state == MINUS ? -1.0 : 0.0; }

/* A X = B for many right-hand sides (rows of B hold one equation), Gauss with partial pivoting; A and B are overwritten. */
static void solve(int n, int count, double *a, double *b) {
  for (int j = 0; j < n; j++) {
    int best = j;
    for (int i = j + 1; i < n; i++)
      if (fabs(a[i * n + j]) > fabs(a[best * n + j])) best = i;
    if (a[best * n + j] == 0.0) fail("a matrix is singular");
    for (int l = 0; l < n && best != j; l++) {
      double x = a[j * n + l];
      a[j * n + l] = a[best * n + l], a[best * n + l] = x;
    }
    for (int l = 0; l < count && best != j; l++) {
      double x = b[j * count + l];
      b[j * count + l] = b[best * count + l], b[best * count + l] = x;
    }
    for (int i = j + 1; i < n; i++) {
      double x = a[i * n + j] / a[j * n + j];
      if (x == 0.0) continue;
      for (int l = j; l < n; l++) a[i * n + l] -= x * a[j * n + l];
      for (int l = 0; l < count; l++) b[i * count + l] -= x * b[j * count + l];
    }
  }
  for (int i = n - 1; i >= 0; i--) {
    for (int j = i + 1; j < n; j++)
      for (int l = 0; l < count; l++) b[i * count + l] -= a[i * n + j] * b[j * count + l];
    for (int l = 0; l < count; l++) b[i * count + l] /= a[i * n + i];
  }
}

/* A^T B C */
static double *congruence(int n, int rows, const double *star, const double *b, const double *c, int columns) {
  double *bc = room((size_t)n * columns, sizeof(double)), *out = room((size_t)rows * columns, sizeof(double));
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++)
      if (b[i * n + j] != 0.0)
        for (int l = 0; l < columns; l++) bc[i * columns + l] += b[i * n + j] * c[j * columns + l];
  for (int i = 0; i < n; i++)
    for (int r = 0; r < rows; r++)
      if (star[i * rows + r] != 0.0)
        for (int l = 0; l < columns; l++) out[r * columns + l] += star[i * rows + r] * bc[i * columns + l];
  free(bc);
  return out;
}

static void make_phase(const Problem *p, const char *active, Phase *out) {
  int o = p->n_o, c = p->n_c, n = o + c;
  double *star = room((size_t)n * o, sizeof(double)), *d = room(n, sizeof(double));
  for (int i = 0; i < o; i++) star[i * o + i] = 1.0;
  int *open = room(c, sizeof(int)), count = 0;
  for (int i = 0; i < c; i++) {
    if (!active[i]) open[count++] = i;
    d[o + i] = active[i] ? p->gap[i] : 0.0;
  }
  /* u_f = N_ff^-1 (-N_fO u_O - N_fc g_c), the constant in the last column */
  double *block = room((size_t)count * count, sizeof(double)), *rhs = room((size_t)count * (o + 1), sizeof(double));
  for (int a = 0; a < count; a++) {
    for (int b = 0; b < count; b++) block[a * count + b] = p->nc[open[a] * c + open[b]];
    for (int j = 0; j < o; j++) rhs[a * (o + 1) + j] = -p->no[open[a] * o + j];
    for (int j = 0; j < c; j++)
      if (active[j]) rhs[a * (o + 1) + o] -= p->nc[open[a] * c + j] * p->gap[j];
  }
  if (count) solve(count, o + 1, block, rhs);
  for (int a = 0; a < count; a++) {
    for (int j = 0; j < o; j++) star[(o + open[a]) * o + j] = rhs[a * (o + 1) + j];
    d[o + open[a]] = rhs[a * (o + 1) + o];
  }
  double *m = congruence(n, o, star, p->m, star, o), *k = congruence(n, o, star, p->k, star, o);
  double *kd = congruence(n, o, star, p->k, d, 1);
  /* pressures of all points */
  double *pressure = room((size_t)c * o, sizeof(double)), *constant = room(c, sizeof(double));
  for (int i = 0; i < c; i++) {
    for (int l = 0; l < c; l++) {
      constant[i] -= p->nc[i * c + l] * d[o + l];
      for (int j = 0; j < o; j++) pressure[i * o + j] -= p->nc[i * c + l] * star[(o + l) * o + j];
    }
    for (int j = 0; j < o; j++) pressure[i * o + j] -= p->no[i * o + j];
  }
  int *stuck = room(c, sizeof(int)), s = 0;
  for (int i = 0; i < c; i++)
    if (active[i] == STICK) stuck[s++] = i;
  /* stiffness, force, and unit forces along what sticks */
  int width = o + 1 + s;
  double *all = room((size_t)o * width, sizeof(double));
  for (int i = 0; i < o; i++) {
    for (int j = 0; j < o; j++) all[i * width + j] = k[i * o + j];
    double f = -kd[i];
    for (int r = 0; r < n; r++) f += star[r * o + i] * p->f[r];
    for (int l = 0; l < c; l++) {
      if (sign(active[l]) == 0.0) continue;
      double e = sign(active[l]) * p->limit[l] * p->e[l * o + i];
      for (int j = 0; e != 0.0 && j < o; j++) all[i * width + j] += e * pressure[l * o + j];
      f -= e * constant[l];
    }
    all[i * width + o] = f;
    for (int l = 0; l < s; l++) all[i * width + o + 1 + l] = p->e[stuck[l] * o + i];
  }
  solve(o, width, m, all);
  /* the forces that hold what sticks, over displacements, and their constants with a minus */
  double *gram = room((size_t)s * s, sizeof(double)), *hold = room((size_t)s * (o + 1), sizeof(double));
  for (int a = 0; a < s; a++)
    for (int i = 0; i < o; i++) {
      double e = p->e[stuck[a] * o + i];
      for (int b = 0; e != 0.0 && b < s; b++) gram[a * s + b] += e * all[i * width + o + 1 + b];
      for (int j = 0; e != 0.0 && j <= o; j++) hold[a * (o + 1) + j] += e * all[i * width + j];
    }
  if (s) solve(s, o + 1, gram, hold);
  for (int i = 0; i < o; i++)
    for (int a = 0; a < s; a++)
      for (int j = 0; j <= o; j++) all[i * width + j] -= all[i * width + o + 1 + a] * hold[a * (o + 1) + j];
  out->active = room(c, 1);
  memcpy(out->active, active, c);
  /* by columns: the product is a sum of columns, which vector instructions take */
  out->stiffness = room((size_t)o * o, sizeof(double));
  out->force = room(o, sizeof(double));
  int count_all = monitors(p), each = p->rubs ? 2 : 1;
  out->rows = room((size_t)count_all * o, sizeof(double));
  out->rates = p->rubs ? room((size_t)count_all * o, sizeof(double)) : NULL;
  out->offset = room(count_all, sizeof(double));
  out->to = room(count_all, 1);
  for (int i = 0; i < o; i++) {
    for (int j = 0; j < o; j++) out->stiffness[j * o + i] = all[i * width + j];
    out->force[i] = all[i * width + o];
  }
  for (int i = 0, a = 0; i < c; i++) {
    int g = each * i;
    double *row = out->rows + (size_t)g * o;
    out->to[g] = active[i] ? OPEN : CLOSED;
    if (!active[i]) {
      out->offset[g] = p->gap[i] - d[o + i];
      for (int j = 0; j < o; j++) row[j] = -star[(o + i) * o + j];
    } else {
      out->offset[g] = constant[i];
      memcpy(row, pressure + (size_t)i * o, o * sizeof(double));
    }
    if (!p->rubs) continue;
    /* the second monitor of a point: slip velocity; of one that sticks the pressure is left to what is left of the limit, which is less */
    double *second = row + o, sigma = sign(active[i]);
    out->to[g + 1] = active[i];
    out->offset[g + 1] = 1.0;
    if (sigma != 0.0) {
      out->to[g + 1] = STICK;
      out->offset[g + 1] = -sigma * p->surface[i];
      for (int j = 0; j < o; j++) out->rates[(size_t)(g + 1) * o + j] = sigma * p->e[i * o + j];
    }
    if (active[i] == STICK) {
      const double *held = hold + (size_t)a++ * (o + 1);
      out->to[g] = PLUS, out->to[g + 1] = MINUS;
      out->offset[g] = p->limit[i] * constant[i] - held[o];
      out->offset[g + 1] = p->limit[i] * constant[i] + held[o];
      for (int j = 0; j < o; j++) {
        row[j] = p->limit[i] * pressure[i * o + j] + held[j];
        second[j] = p->limit[i] * pressure[i * o + j] - held[j];
      }
    }
  }
  free(pressure), free(constant), free(stuck), free(gram), free(hold);
  free(star), free(d), free(open), free(block), free(rhs), free(m), free(k), free(kd), free(all);
}

static void enter(Body *body, const char *active) {
  for (int i = 0; i < body->count; i++)
    if (!memcmp(body->phases[i].active, active, body->p->n_c)) {
      body->phase = &body->phases[i];
      return;
    }
  if (body->count == MOST_PHASES) fail("too many phases");
  double start = now();
  make_phase(body->p, active, &body->phases[body->count]);
  body->setup += now() - start;
  body->phase = &body->phases[body->count++];
}

static int rhs(realtype t, N_Vector y, N_Vector dy, void *data) {
  (void)t;
  Body *body = data;
  int n = body->p->n_o;
  const double *x = N_VGetArrayPointer(y), *s = body->phase->stiffness;
  double *restrict out = N_VGetArrayPointer(dy);
  memcpy(out, x + n, n * sizeof(double));
  memcpy(out + n, body->phase->force, n * sizeof(double));
  for (int j = 0; j < n; j++, s += n)
    for (int i = 0; i < n; i++) out[n + i] -= s[i] * x[j];
  body->nfev++;
  return 0;
}

static int roots(realtype t, N_Vector y, realtype *g, void *data) {
  (void)t;
  Body *body = data;
  int n = body->p->n_o;
  const double *x = N_VGetArrayPointer(y), *row = body->phase->rows, *rate = body->phase->rates;
  int count = monitors(body->p);
  for (int i = 0; i < count; i++, row += n) {
    double sum = body->phase->offset[i];
    for (int j = 0; j < n; j++) sum += row[j] * x[j];
    if (rate && body->phase->to[i] == STICK)
      for (int j = 0; j < n; j++) sum += rate[(size_t)i * n + j] * x[n + j];
    g[i] = sum;
  }
  return 0;
}

/* What a point does that comes into contact. */
static char slipping(const Problem *p, int i, const double *x) {
  if (!p->rubs || p->limit[i] == 0.0) return CLOSED;
  int n = p->n_o;
  double v = -p->surface[i], size = 0.0;
  for (int j = 0; j < n; j++) v += p->e[i * n + j] * x[n + j], size = fmax(size, fabs(x[n + j]));
  return fabs(v) <= 1e-12 * size ? STICK : v > 0.0 ? PLUS : MINUS;
}

/* The state of a point behind a monitor, and the velocities: what comes to rest does so exactly. */
static void change(const Body *body, char *active, int k, double *x) {
  const Problem *p = body->p;
  int i = p->rubs ? k / 2 : k, n = p->n_o;
  char to = body->phase->to[k];
  if (to == STICK) {
    double v = -p->surface[i], size = 0.0;
    for (int j = 0; j < n; j++) v += p->e[i * n + j] * x[n + j], size += p->e[i * n + j] * p->e[i * n + j];
    for (int j = 0; j < n; j++) x[n + j] -= v / size * p->e[i * n + j];
  }
  active[i] = to == CLOSED ? slipping(p, i, x) : to;
}

/* With friction: states in which nothing is held by more than friction can, and their phase. */
static void settle(Body *body, char *active, N_Vector y) {
  int c = body->p->n_c, count = monitors(body->p), n = body->p->n_o;
  double *g = room(count, sizeof(double)), *x = N_VGetArrayPointer(y);
  enter(body, active);
  for (int k = 0; body->p->rubs && k < 4 * c; k++) {
    roots(0.0, y, g, body);
    int worst = -1;
    for (int i = 0; i < count; i++) {
      if (active[i / 2] != STICK) continue;
      double size = 0.0;
      for (int j = 0; j < n; j++) size += fabs(body->phase->rows[(size_t)i * n + j] * x[j]);
      if (g[i] < -1e-12 * size && (worst < 0 || g[i] < g[worst])) worst = i;
    }
    if (worst < 0) break;
    change(body, active, worst, x);
    enter(body, active);
  }
  free(g);
}

static void check(int flag) {
  if (flag < 0) fail("SUNDIALS gave up");
}

/* One run; order 0 is CVODE's Adams method. Returns the number of switches. */
static int run(Body *body, int order, double rtol, N_Vector y, double *times, SUNContext context) {
  const Problem *p = body->p;
  int n = p->n_o, c = p->n_c, count = 0;
  double *x = N_VGetArrayPointer(y), t = 0.0;
  memcpy(x, p->u0, n * sizeof(double));
  memcpy(x + n, p->v0, n * sizeof(double));
  char *active = room(c, 1);
  memcpy(active, p->active0, c);
  int all = monitors(p);
  int *falling = room(all, sizeof(int)), *found = room(all, sizeof(int));
  for (int i = 0; i < all; i++) falling[i] = -1;
  for (int i = 0; i < c; i++)
    if (active[i]) active[i] = slipping(p, i, x);
  settle(body, active, y);
  void *mem = order ? ERKStepCreate(rhs, t, y, context) : CVodeCreate(CV_ADAMS, context);
  SUNNonlinearSolver fixed = NULL;
  if (order) {
    check(ERKStepSStolerances(mem, rtol, 1e-3 * rtol));
    check(ERKStepSetUserData(mem, body));
    check(ERKStepSetOrder(mem, order));
    check(ERKStepSetMaxNumSteps(mem, 100000000));
    check(ERKStepRootInit(mem, all, roots));
    check(ERKStepSetRootDirection(mem, falling));
    check(ERKStepSetNoInactiveRootWarn(mem));
  } else {
    check(CVodeInit(mem, rhs, t, y));
    check(CVodeSStolerances(mem, rtol, 1e-3 * rtol));
    check(CVodeSetUserData(mem, body));
    fixed = SUNNonlinSol_FixedPoint(y, 0, context);
    check(CVodeSetNonlinearSolver(mem, fixed));
    check(CVodeSetMaxNumSteps(mem, 100000000));
    check(CVodeRootInit(mem, all, roots));
    check(CVodeSetRootDirection(mem, falling));
    check(CVodeSetNoInactiveRootWarn(mem));
  }
  while (t < p->until) {
    int flag;
    if (order) {
      check(ERKStepSetStopTime(mem, p->until));
      check(flag = ERKStepEvolve(mem, p->until, y, &t, ARK_NORMAL));
    } else {
      check(CVodeSetStopTime(mem, p->until));
      check(flag = CVode(mem, p->until, y, &t, CV_NORMAL));
    }
    if (flag != (order ? ARK_ROOT_RETURN : CV_ROOT_RETURN)) continue;
    check(order ? ERKStepGetRootInfo(mem, found) : CVodeGetRootInfo(mem, found));
    for (int k = 0; k < all; k++)
      if (found[k]) {
        if (count == MOST_SWITCHES) fail("too many switches");
        times[count++] = t;
        change(body, active, k, x);
      }
    settle(body, active, y);
    check(order ? ERKStepReInit(mem, rhs, t, y) : CVodeReInit(mem, t, y));
  }
  if (order)
    ERKStepFree(&mem);
  else
    CVodeFree(&mem), SUNNonlinSolFree(fixed);
  free(active), free(falling), free(found);
  return count;
}

static int ascending(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

static void list(const char *name, const double *x, int n) {
  printf(", \"%s\": [", name);
  for (int i = 0; i < n; i++) printf(i ? ", %.17g" : "%.17g", x[i]);
  printf("]");
}

int main(int count, char **argument) {
  if (count != 3) fail("usage: sundials_peer PROBLEM REPEATS");
  Problem p = read_problem(argument[1]);
  int repeats = atoi(argument[2]);
  SUNContext context;
  if (SUNContext_Create(NULL, &context)) fail("SUNDIALS cannot be begun");
  const struct {
    const char *name;
    int order;
  } methods[] = {{"CVODE Adams", 0}, {"ARKODE ERK 5", 5}, {"ARKODE ERK 8", 8}};
  const double ladder[] = {1e-4, 1e-6, 1e-8, 1e-10, 1e-12};
  N_Vector y = N_VNew_Serial(2 * p.n_o, context);
  double *times = room(MOST_SWITCHES, sizeof(double)), *walls = room(repeats + 1, sizeof(double));
  for (int m = 0; m < 3; m++)
    for (int l = 0; l < 5; l++) {
      Body *body = room(1, sizeof(Body));
      body->p = &p;
      int switches = run(body, methods[m].order, ladder[l], y, times, context);
      for (int r = 0; r < repeats; r++) {
        body->nfev = 0;
        double start = now();
        switches = run(body, methods[m].order, ladder[l], y, times, context);
        walls[r] = now() - start;
      }
      qsort(walls, repeats, sizeof(double), ascending);
      printf("{\"method\": \"%s\", \"rtol\": %g, \"wall_s\": %.9g, \"setup_s\": %.9g, \"nfev\": %ld", methods[m].name, ladder[l],
             walls[repeats / 2], body->setup, body->nfev);
      list("u", N_VGetArrayPointer(y), p.n_o);
      list("v", N_VGetArrayPointer(y) + p.n_o, p.n_o);
      list("switches", times, switches);
      printf("}\n");
      fflush(stdout);
      for (int i = 0; i < body->count; i++)
        free(body->phases[i].active), free(body->phases[i].stiffness), free(body->phases[i].force), free(body->phases[i].rows), free(body->phases[i].rates),
            free(body->phases[i].offset), free(body->phases[i].to);
      free(body);
    }
  return 0;
}
