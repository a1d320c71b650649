"""Named expressions: the only folder that knows CasADi's sharp edges."""
