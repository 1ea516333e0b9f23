//! Removes the branches of a kernel that its features exclude: a browser compiles what is handed to
//! it, so that the text must have only what the scene needs.

use naga::{
    Arena, BinaryOperator, Block, Expression, Function, Handle, Literal, Module, Override, Statement,
    UnaryOperator,
};

/// Constant value of an expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Value {
    Word(u32),
    Truth(bool),
}

/// Replaces the specialisation constants by their values, and removes branches that they exclude.
pub fn remove(module: &mut Module) {
    let words: Vec<(Handle<Override>, Option<Value>)> =
        module.overrides.iter().map(|(handle, constant)| (handle, literal(module, constant.init))).collect();
    let value_of = |of: Handle<Override>| words.iter().find(|(handle, _)| *handle == of)?.1;
    let constants: Vec<Option<Value>> =
        module.constants.iter().map(|(_, constant)| literal(module, Some(constant.init))).collect();
    let functions = module.functions.iter_mut().map(|(_, function)| function);
    for function in functions.chain(module.entry_points.iter_mut().map(|entry| &mut entry.function)) {
        for (_, expression) in function.expressions.iter_mut() {
            if let Expression::Override(of) = *expression
                && let Some(Value::Word(value)) = value_of(of)
            {
                *expression = Expression::Literal(Literal::U32(value));
            }
        }
        let mut known = vec![Stored::Nothing; function.local_variables.len()];
        // Each branch that goes may leave one value in a variable that joins branches.
        loop {
            let values = values(&function.expressions, &constants, &known);
            prune(&mut function.body, &values);
            let now = stored(function, &values);
            if now == known {
                break;
            }
            known = now;
        }
        // Names would keep expressions that nothing uses.
        function.named_expressions.clear();
    }
}

/// Values that a function stores in a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stored {
    /// Nothing: it is never read.
    Nothing,
    /// One value, before each read: naga makes such variables of values that join branches.
    One(Value),
    /// Different values, or unknown ones.
    Any,
}

/// Returns what is stored in each variable.
fn stored(function: &Function, values: &[Option<Value>]) -> Vec<Stored> {
    let mut stored: Vec<Stored> = function
        .local_variables
        .iter()
        .map(|(_, variable)| match variable.name.as_deref() {
            Some(name) if name.starts_with("phi_") => Stored::Nothing,
            _ => Stored::Any,
        })
        .collect();
    visit(&function.body, &mut |statement| {
        if let Statement::Store { pointer, value } = *statement
            && let Expression::LocalVariable(variable) = function.expressions[pointer]
        {
            let value = values.get(value.index()).copied().flatten().map_or(Stored::Any, Stored::One);
            let place = &mut stored[variable.index()];
            *place = if *place == Stored::Nothing || *place == value { value } else { Stored::Any };
        }
    });
    stored
}

/// Calls `with` with all statements of a block.
fn visit(block: &Block, with: &mut impl FnMut(&Statement)) {
    for statement in block.iter() {
        with(statement);
        match statement {
            Statement::Block(inner) => visit(inner, with),
            Statement::If { accept, reject, .. } => [accept, reject].iter().for_each(|of| visit(of, with)),
            Statement::Loop { body, continuing, .. } => {
                [body, continuing].iter().for_each(|of| visit(of, with));
            }
            Statement::Switch { cases, .. } => cases.iter().for_each(|case| visit(&case.body, with)),
            _ => {}
        }
    }
}

/// Returns the value of a global expression that is a literal.
fn literal(module: &Module, expression: Option<Handle<Expression>>) -> Option<Value> {
    match module.global_expressions[expression?] {
        Expression::Literal(Literal::U32(value)) => Some(Value::Word(value)),
        Expression::Literal(Literal::Bool(value)) => Some(Value::Truth(value)),
        _ => None,
    }
}

/// Returns the constant values of a function's expressions, which follow their operands.
fn values(
    expressions: &Arena<Expression>,
    constants: &[Option<Value>],
    known: &[Stored],
) -> Vec<Option<Value>> {
    let mut values: Vec<Option<Value>> = Vec::with_capacity(expressions.len());
    for (_, expression) in expressions.iter() {
        let of = |operand: Handle<Expression>| values.get(operand.index()).copied().flatten();
        values.push(match *expression {
            Expression::Literal(Literal::U32(value)) => Some(Value::Word(value)),
            Expression::Literal(Literal::Bool(value)) => Some(Value::Truth(value)),
            Expression::Constant(constant) => constants.get(constant.index()).copied().flatten(),
            Expression::Load { pointer } => match expressions[pointer] {
                Expression::LocalVariable(variable) => match known.get(variable.index()) {
                    Some(Stored::One(value)) => Some(*value),
                    _ => None,
                },
                _ => None,
            },
            Expression::Unary { op: UnaryOperator::LogicalNot, expr } => match of(expr) {
                Some(Value::Truth(value)) => Some(Value::Truth(!value)),
                _ => None,
            },
            Expression::Binary { op, left, right } => binary(op, of(left), of(right)),
            Expression::Select { condition, accept, reject } => match of(condition) {
                Some(Value::Truth(true)) => of(accept),
                Some(Value::Truth(false)) => of(reject),
                _ => None,
            },
            _ => None,
        });
    }
    values
}

fn binary(op: BinaryOperator, left: Option<Value>, right: Option<Value>) -> Option<Value> {
    use BinaryOperator as Op;
    use Value::{Truth, Word};
    match (op, left, right) {
        (Op::And, Some(Word(a)), Some(Word(b))) => Some(Word(a & b)),
        (Op::InclusiveOr, Some(Word(a)), Some(Word(b))) => Some(Word(a | b)),
        (Op::Equal, Some(a), Some(b)) => Some(Truth(a == b)),
        (Op::NotEqual, Some(a), Some(b)) => Some(Truth(a != b)),
        (Op::And | Op::LogicalAnd, Some(Truth(false)), _)
        | (Op::And | Op::LogicalAnd, _, Some(Truth(false))) => Some(Truth(false)),
        (Op::And | Op::LogicalAnd, Some(Truth(true)), other)
        | (Op::And | Op::LogicalAnd, other, Some(Truth(true))) => other,
        (Op::InclusiveOr | Op::LogicalOr, Some(Truth(true)), _)
        | (Op::InclusiveOr | Op::LogicalOr, _, Some(Truth(true))) => Some(Truth(true)),
        (Op::InclusiveOr | Op::LogicalOr, Some(Truth(false)), other)
        | (Op::InclusiveOr | Op::LogicalOr, other, Some(Truth(false))) => other,
        _ => None,
    }
}

/// Replaces branches with a constant condition by what they run, here and within.
fn prune(block: &mut Block, values: &[Option<Value>]) {
    let mut kept = Block::new();
    for (statement, span) in std::mem::take(block).span_into_iter() {
        match statement {
            Statement::If { condition, mut accept, mut reject } => {
                match values.get(condition.index()).copied().flatten() {
                    Some(Value::Truth(is_taken)) => {
                        let mut taken = if is_taken { accept } else { reject };
                        prune(&mut taken, values);
                        kept.append(&mut taken);
                    }
                    _ => {
                        prune(&mut accept, values);
                        prune(&mut reject, values);
                        kept.push(Statement::If { condition, accept, reject }, span);
                    }
                }
            }
            Statement::Block(mut inner) => {
                prune(&mut inner, values);
                kept.append(&mut inner);
            }
            Statement::Loop { mut body, mut continuing, break_if } => {
                prune(&mut body, values);
                prune(&mut continuing, values);
                kept.push(Statement::Loop { body, continuing, break_if }, span);
            }
            Statement::Switch { selector, mut cases } => {
                cases.iter_mut().for_each(|case| prune(&mut case.body, values));
                kept.push(Statement::Switch { selector, cases }, span);
            }
            other => kept.push(other, span),
        }
        // Nothing runs after the end of a block.
        if matches!(kept.last(), Some(Statement::Break | Statement::Continue | Statement::Return { .. })) {
            break;
        }
    }
    *block = kept;
}
