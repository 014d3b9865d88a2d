//! Result records, and what is made of them: tables, plots, the page.
